//! Triangle meshes.

use super::name_or_index;
use crate::Error;

/// An indexed triangle list. Counter-clockwise triangles face the viewer.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Name for messages; may be empty.
    pub name: String,
    /// Vertex positions, mesh space.
    pub positions: Vec<[f32; 3]>,
    /// Shading normals, mesh space, one per vertex, or none: then every triangle is flat. Zero-length ones count as
    /// absent; the others need not be normalised.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, one per vertex, or none.
    pub tex_coords: Vec<[f32; 2]>,
    /// Three per triangle.
    pub indices: Vec<u32>,
}

impl Mesh {
    /// Checks lengths, indices and every number.
    ///
    /// # Errors
    /// [`Error::InvalidScene`] with mesh, vertex and field named.
    pub fn validate(&self, index: usize) -> Result<(), Error> {
        let error = |field: String, problem: String| {
            Err(Error::scene("mesh", name_or_index(&self.name, index), field, problem))
        };
        let count = self.positions.len();
        if !self.indices.len().is_multiple_of(3) {
            return error(
                "index count".into(),
                format!("is {}, not a multiple of three", self.indices.len()),
            );
        }
        for (field, length) in [("normals", self.normals.len()), ("tex_coords", self.tex_coords.len())] {
            if length != 0 && length != count {
                return error(field.into(), format!("are {length}, but there are {count} vertices"));
            }
        }
        if let Some(at) = self.indices.iter().position(|&i| i as usize >= count) {
            return error(
                format!("index {at}"),
                format!("is {}, but there are {count} vertices", self.indices[at]),
            );
        }
        let lists: [(&str, &[[f32; 3]]); 2] = [("position", &self.positions), ("normal", &self.normals)];
        for (field, values) in lists {
            if let Some(at) = values.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
                return error(
                    format!("{field} of vertex {at}"),
                    format!("is {:?}, not finite", values[at]),
                );
            }
        }
        if let Some(at) = self.tex_coords.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
            return error(
                format!("tex_coord of vertex {at}"),
                format!("is {:?}, not finite", self.tex_coords[at]),
            );
        }
        Ok(())
    }
}

//! Surface materials and the images they use, by the conventions of glTF 2.0.

use super::name_or_index;
use crate::Error;

/// Index of refraction where a material names none.
const DEFAULT_INDEX_OF_REFRACTION: f32 = 1.5;

/// Twin of `LOBE_MULTIPLE` in `shaders/common/lobe.wgsl`.
const LOBE_MULTIPLE: f32 = 2.0;

/// A surface. All surfaces reflect on both sides; emission leaves the front side only.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name for messages; may be empty.
    pub name: String,
    /// Reflectance, linear RGB, each in [0, 1]: of a diffuse surface the Lambertian BRDF is `base_color` / π; of metal it is the
    /// colour of what is reflected, of glass of what passes.
    pub base_color: [f32; 3],
    /// Multiplied with `base_color`; its alpha is opacity. Index into [`Scene::textures`](super::Scene::textures).
    pub base_color_texture: Option<usize>,
    /// Above 0.5 the surface is a metal.
    pub metallic: f32,
    /// Perceptual roughness in [0, 1]; GGX α = roughness².
    pub roughness: f32,
    /// Of a metal: a Phong lobe of this exponent, 1 to 60 000, instead of GGX. glTF has none; for the scenes of papers.
    pub phong_exponent: Option<f32>,
    /// Of a rough metal: gives back the light that bounces between its facets, which GGX alone takes as lost (up to two thirds at
    /// roughness 1). Its white furnace is white within 1 % at up to 84° from its normal, 4 % beyond; its scattering is not
    /// the same both ways then. Off in what other renderers are compared with. Has no effect on smooth or Phong metals.
    pub multiple_scattering: bool,
    /// Multiplies `roughness` (green; no Phong exponent) and `metallic` (blue). Index into the scene's textures.
    pub metallic_roughness_texture: Option<usize>,
    /// Emitted radiance, W/m²/sr, linear RGB, front side.
    pub emission: [f32; 3],
    /// Multiplied with `emission`. Index into the scene's textures.
    pub emission_texture: Option<usize>,
    /// Above 0.5 the surface is a dielectric that transmits light.
    pub transmission: f32,
    /// Index of refraction of a transmitting material, at least 1.
    pub index_of_refraction: f32,
    /// Texels whose opacity is below this are holes; `None`: no holes.
    pub alpha_cutoff: Option<f32>,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: [1.0; 3],
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            phong_exponent: None,
            multiple_scattering: false,
            metallic_roughness_texture: None,
            emission: [0.0; 3],
            emission_texture: None,
            transmission: 0.0,
            index_of_refraction: DEFAULT_INDEX_OF_REFRACTION,
            alpha_cutoff: None,
        }
    }
}

impl Material {
    /// A Lambertian surface of this reflectance.
    pub fn diffuse(name: &str, base_color: [f32; 3]) -> Self {
        Self {
            name: name.into(),
            base_color,
            ..Self::default()
        }
    }

    /// Whether the surface emits light.
    pub fn is_emissive(&self) -> bool {
        self.emission.iter().any(|&e| e > 0.0)
    }

    /// Whether light passes through.
    pub fn is_transmissive(&self) -> bool {
        self.transmission > 0.5
    }

    /// Whether the surface is a metal.
    pub fn is_metal(&self) -> bool {
        self.metallic > 0.5 && !self.is_transmissive()
    }

    /// Roughness as shaders take it: that of GGX, that plus `LOBE_MULTIPLE` with multiple scattering, or minus the exponent of a
    /// Phong lobe.
    pub(crate) fn lobe_roughness(&self) -> f32 {
        match self.phong_exponent {
            _ if self.is_transmissive() => self.roughness,
            Some(exponent) => -exponent,
            None if self.multiple_scattering => LOBE_MULTIPLE + self.roughness,
            None => self.roughness,
        }
    }

    /// Checks every factor and texture index.
    ///
    /// # Errors
    /// [`Error::InvalidScene`].
    pub fn validate(&self, index: usize, texture_count: usize) -> Result<(), Error> {
        let error = |field: &str, problem: String| {
            Err(Error::scene(
                "material",
                name_or_index(&self.name, index),
                field,
                problem,
            ))
        };
        let unit_fields = [
            ("base_color red", self.base_color[0]),
            ("base_color green", self.base_color[1]),
            ("base_color blue", self.base_color[2]),
            ("metallic", self.metallic),
            ("roughness", self.roughness),
            ("transmission", self.transmission),
            ("alpha_cutoff", self.alpha_cutoff.unwrap_or(0.0)),
        ];
        for (field, value) in unit_fields {
            if !(0.0..=1.0).contains(&value) {
                return error(field, format!("is {value}; expected between 0 and 1"));
            }
        }
        if let Some(exponent) = self.phong_exponent.filter(|e| !(1.0..=60_000.0).contains(e)) {
            return error("phong_exponent", format!("is {exponent}; expected between 1 and 60000"));
        }
        if !self.emission.iter().all(|e| e.is_finite() && *e >= 0.0) {
            return error(
                "emission",
                format!("is {:?}; expected finite and not negative", self.emission),
            );
        }
        if !(self.index_of_refraction >= 1.0 && self.index_of_refraction.is_finite()) {
            return error(
                "index_of_refraction",
                format!("is {}; expected at least 1", self.index_of_refraction),
            );
        }
        let textures = [
            ("base_color_texture", self.base_color_texture),
            ("metallic_roughness_texture", self.metallic_roughness_texture),
            ("emission_texture", self.emission_texture),
        ];
        for (field, texture) in textures {
            if let Some(texture) = texture.filter(|&t| t >= texture_count) {
                return error(field, format!("is {texture}, but there are {texture_count} textures"));
            }
        }
        Ok(())
    }
}

/// An image, four bytes per texel, rows from the top. Coordinates repeat; filtering is linear.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// Name for messages; may be empty.
    pub name: String,
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Whether RGB is sRGB-encoded (colours) or linear (roughness and the like).
    pub srgb: bool,
    /// RGBA, `4 * width * height` bytes.
    pub rgba: Vec<u8>,
}

impl Texture {
    /// Checks size and length.
    ///
    /// # Errors
    /// [`Error::InvalidScene`].
    pub fn validate(&self, index: usize) -> Result<(), Error> {
        let error = |field: &str, problem: String| {
            Err(Error::scene(
                "texture",
                name_or_index(&self.name, index),
                field,
                problem,
            ))
        };
        if self.width == 0 || self.height == 0 {
            return error(
                "size",
                format!("is {}×{}; expected at least 1×1", self.width, self.height),
            );
        }
        let expected = 4 * self.width as usize * self.height as usize;
        if self.rgba.len() != expected {
            return error("rgba", format!("holds {} bytes; expected {expected}", self.rgba.len()));
        }
        Ok(())
    }
}

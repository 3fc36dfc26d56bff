//! glTF 2.0 files as scenes: `.glb`, and `.gltf` with external or embedded buffers and images.
//!
//! A file is never trusted: the parsed JSON is read through checked look-ups alone, and every accessor is measured
//! against its view and buffer before a byte of it is read. The `gltf` crate's own readers and its validation assume
//! well-formed files and panic on others, so only its parser and its types are used.
//!
//! What a [`Material`] has no field for is left out: normal, occlusion and transmission textures, vertex colours,
//! samplers (coordinates repeat, filtering is linear), and blending (`BLEND` is opaque).

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{Interpolation, Property};
use gltf::json::extensions::scene::khr_lights_punctual::{Light as PunctualLight, Type as PunctualType};
use gltf::json::material::AlphaMode;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{self, Root, camera, texture};
use lightfall::glam::{DAffine3, DMat3, DQuat, DVec3, DVec4};
use lightfall::scene::{Camera, Instance, Light, LightKind, Material, Mesh, Projection, Scene, Texture};
use serde_json::Value;
use std::borrow::Cow;
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Extensions that a file may require. `KHR_mesh_quantization` only widens the component types of vertex attributes,
/// all of which are read anyway.
const EXTENSIONS: [&str; 5] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_mesh_quantization",
];

/// Opacity below which a `MASK` material has holes if the file does not say: glTF 2.0, `material.alphaCutoff`.
const DEFAULT_ALPHA_CUTOFF: f32 = 0.5;

/// Bytes of the header of a `.glb`: magic, version, length.
const GLB_HEADER: usize = 12;

/// Reads a file as a scene, every animation in it at `time` seconds.
///
/// # Errors
/// One line that says what is wrong, and where.
pub(crate) fn load(path: &Path, time: f64) -> Result<Scene, String> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|error| format!("{name}: {error}"))?;
    load_slice(&bytes, path.parent(), &name, time)
}

/// Reads the bytes of a `.glb` or `.gltf` as a scene. External files are looked up in `base_dir`; `name` begins every
/// error.
///
/// # Errors
/// As [`load`].
pub(crate) fn load_slice(bytes: &[u8], base_dir: Option<&Path>, name: &str, time: f64) -> Result<Scene, String> {
    // Nothing here or in the decoders beneath is known to panic; if something does, it is still only this file's fault.
    catch_unwind(AssertUnwindSafe(|| convert(bytes, base_dir, time)))
        .unwrap_or_else(|_| Err("the file makes the loader panic".into()))
        .map_err(|error| format!("{name}: {error}"))
}

fn convert(bytes: &[u8], base_dir: Option<&Path>, time: f64) -> Result<Scene, String> {
    if !time.is_finite() {
        return Err(format!("time is {time}; expected finite seconds"));
    }
    let (text, blob) = split(bytes)?;
    let file = File::parse(&text, blob, base_dir)?;
    let mut locals = local_transforms(&file.root, &text)?;
    play_animations(&file, &mut locals, time)?;
    let mut builder = Builder::new(&file);
    builder.add_materials()?;
    builder.add_nodes(&locals)?;
    builder.scene.validate().map_err(|error| error.to_string())?;
    Ok(builder.scene)
}

/// The JSON of a file, and its binary chunk if it has one.
type Chunks<'a> = (Cow<'a, [u8]>, Option<Cow<'a, [u8]>>);

/// The JSON text and the binary chunk of a `.glb`; a `.gltf` is text as a whole.
fn split(bytes: &[u8]) -> Result<Chunks<'_>, String> {
    if bytes.is_empty() {
        return Err("the file is empty".into());
    }
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.into(), None));
    }
    // The length is checked here because the crate subtracts the header's size from it unseen.
    let ends_early = |length: usize| format!("the file ends after {} of {length} bytes", bytes.len());
    let header = bytes.get(..GLB_HEADER).ok_or_else(|| ends_early(GLB_HEADER))?;
    let length = little_endian(&header[8..]) as usize;
    if length < GLB_HEADER {
        return Err(format!("the header gives the file {length} bytes, fewer than its own"));
    }
    let whole = bytes.get(..length).ok_or_else(|| ends_early(length))?;
    let glb = gltf::Glb::from_slice(whole).map_err(|error| format!("broken .glb: {error}"))?;
    Ok((glb.json, glb.bin))
}

/// Item `index` of a list that the file calls `what`.
fn at<'t, T>(list: &'t [T], index: usize, what: &str) -> Result<&'t T, String> {
    list.get(index)
        .ok_or_else(|| format!("{what} #{index} does not exist; the file has {}", list.len()))
}

/// A value of an enumeration that the file may have misspelt.
fn checked<T: Copy>(value: &Checked<T>, field: &str) -> Result<T, String> {
    match value {
        Checked::Valid(value) => Ok(*value),
        Checked::Invalid => Err(format!("{field} has a value that glTF 2.0 does not know")),
    }
}

/// A name for messages: the item's own, or its index in the file.
fn label(name: Option<&String>, index: usize) -> String {
    name.filter(|name| !name.is_empty())
        .cloned()
        .unwrap_or_else(|| format!("#{index}"))
}

// ---- The file: buffers, views, accessors --------------------------------------------------------------------------

/// A parsed file with its buffers in memory.
struct File<'a> {
    root: Root,
    buffers: Vec<Cow<'a, [u8]>>,
    base_dir: Option<&'a Path>,
}

impl<'a> File<'a> {
    fn parse(text: &[u8], blob: Option<Cow<'a, [u8]>>, base_dir: Option<&'a Path>) -> Result<Self, String> {
        let root: Root =
            json::deserialize::from_slice(text).map_err(|error| format!("not glTF, or broken JSON: {error}"))?;
        if !root.asset.version.starts_with("2.") {
            return Err(format!("glTF version {:?}; expected 2.0", root.asset.version));
        }
        let is_unknown = |name: &&String| !EXTENSIONS.contains(&name.as_str());
        if let Some(name) = root.extensions_required.iter().find(is_unknown) {
            return Err(format!("not available: the file requires the extension {name}"));
        }
        let buffers = read_buffers(&root, blob, base_dir)?;
        Ok(Self {
            root,
            buffers,
            base_dir,
        })
    }

    /// The bytes of a buffer view.
    fn view(&self, index: usize) -> Result<&[u8], String> {
        let view = at(&self.root.buffer_views, index, "bufferView")?;
        let buffer = at(&self.buffers, view.buffer.value(), "buffer")?;
        let start = view.byte_offset.unwrap_or_default().0;
        let bytes = start
            .checked_add(view.byte_length.0)
            .and_then(|end| slice(buffer, start, end));
        bytes.ok_or_else(|| {
            format!(
                "bufferView #{index} takes {} bytes from byte {start} of buffer #{}, which holds {}",
                view.byte_length.0,
                view.buffer.value(),
                buffer.len()
            )
        })
    }

    /// The elements of an accessor, all of them inside its view.
    fn elements(&self, index: usize, expected: Type) -> Result<Elements<'_>, String> {
        let accessor = at(&self.root.accessors, index, "accessor")?;
        let error = |problem: String| Err(format!("accessor #{index} {problem}"));
        if accessor.sparse.is_some() {
            return error("is sparse, which is not available yet".into());
        }
        let Some(view_index) = accessor.buffer_view.map(|view| view.value()) else {
            return error("names no bufferView".into());
        };
        let kind = checked(&accessor.type_, "accessor type")?;
        if kind != expected {
            return error(format!("is of type {kind:?}; expected {expected:?}"));
        }
        let component = checked(&accessor.component_type, "accessor componentType")?.0;
        let size = component.size() * kind.multiplicity();
        let view = self.view(view_index)?;
        let stride = self.root.buffer_views[view_index].byte_stride;
        // A stride of zero is not glTF, but the crate's parser documents it as tightly packed.
        let stride = stride.map_or(size, |stride| if stride.0 == 0 { size } else { stride.0 });
        if stride < size {
            return error(format!("has elements of {size} bytes every {stride} bytes"));
        }
        let (offset, count) = (accessor.byte_offset.unwrap_or_default().0, accessor.count.0);
        let end = end_of_elements(offset, count, stride as u64, size as u64);
        let Some(bytes) = end.and_then(|end| slice(view, offset, end)) else {
            return error(format!(
                "has {count} elements every {stride} bytes from {offset}; its bufferView #{view_index} holds {} bytes",
                view.len()
            ));
        };
        Ok(Elements {
            bytes,
            stride,
            size,
            component,
            normalized: accessor.normalized,
        })
    }

    /// An accessor of scalars or vectors as floating-point numbers.
    fn floats<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>, String> {
        let expected = match N {
            1 => Type::Scalar,
            2 => Type::Vec2,
            3 => Type::Vec3,
            _ => Type::Vec4,
        };
        let elements = self.elements(index, expected)?;
        if elements.component == ComponentType::U32 {
            return Err(format!("accessor #{index} holds U32; expected F32 or shorter integers"));
        }
        let width = elements.component.size();
        let read = |element: &[u8]| std::array::from_fn(|i| elements.float(&element[i * width..(i + 1) * width]));
        Ok(elements.iter().map(read).collect())
    }

    /// An accessor of vertex indices.
    fn indices(&self, index: usize) -> Result<Vec<u32>, String> {
        let elements = self.elements(index, Type::Scalar)?;
        match elements.component {
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => {
                Ok(elements.iter().map(little_endian).collect())
            }
            other => Err(format!(
                "accessor #{index} holds {other:?}, but vertex indices are U8, U16 or U32"
            )),
        }
    }
}

/// Where the last element ends; the space up to the stride need not follow it. `None` if 64 bits cannot tell.
fn end_of_elements(offset: u64, count: u64, stride: u64, size: u64) -> Option<u64> {
    match count.checked_sub(1) {
        Some(before_last) => before_last.checked_mul(stride)?.checked_add(size)?.checked_add(offset),
        None => Some(offset),
    }
}

/// `bytes[start..end]`, if that lies inside.
fn slice(bytes: &[u8], start: u64, end: u64) -> Option<&[u8]> {
    bytes.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?)
}

/// Up to four bytes as a number, the least significant one first.
fn little_endian(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}

/// The data of an accessor: `size` bytes every `stride` bytes.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    component: ComponentType,
    normalized: bool,
}

impl Elements<'_> {
    fn iter(&self) -> impl Iterator<Item = &[u8]> {
        // The last chunk ends with its element, short of the stride.
        self.bytes.chunks(self.stride).map(|chunk| &chunk[..self.size])
    }

    /// One component; normalised integers by the rules of glTF 2.0, section 3.6.2.2.
    fn float(&self, bytes: &[u8]) -> f32 {
        let word = little_endian(bytes);
        let (value, largest) = match self.component {
            ComponentType::F32 => return f32::from_bits(word),
            ComponentType::I8 => (f32::from(word as u8 as i8), f32::from(i8::MAX)),
            ComponentType::U8 => (f32::from(word as u8), f32::from(u8::MAX)),
            ComponentType::I16 => (f32::from(word as u16 as i16), f32::from(i16::MAX)),
            ComponentType::U16 => (f32::from(word as u16), f32::from(u16::MAX)),
            ComponentType::U32 => (word as f32, u32::MAX as f32),
        };
        if self.normalized {
            (value / largest).max(-1.0)
        } else {
            value
        }
    }
}

fn read_buffers<'a>(
    root: &Root,
    blob: Option<Cow<'a, [u8]>>,
    base_dir: Option<&Path>,
) -> Result<Vec<Cow<'a, [u8]>>, String> {
    let mut blob = blob;
    let mut read = |index: usize, buffer: &json::Buffer| -> Result<Cow<'a, [u8]>, String> {
        let bytes = match &buffer.uri {
            Some(uri) => Cow::Owned(read_uri(uri, base_dir)?),
            // Only the first buffer may be the binary chunk.
            None => blob.take().filter(|_| index == 0).ok_or("is missing from the file")?,
        };
        let expected = buffer.byte_length.0;
        if (bytes.len() as u64) < expected {
            return Err(format!("holds {} bytes; expected {expected}", bytes.len()));
        }
        Ok(bytes)
    };
    root.buffers
        .iter()
        .enumerate()
        .map(|(index, buffer)| read(index, buffer).map_err(|error| format!("buffer #{index}: {error}")))
        .collect()
}

// ---- URIs ---------------------------------------------------------------------------------------------------------

/// The bytes behind a `data:` URI or a relative path.
fn read_uri(uri: &str, base_dir: Option<&Path>) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (_, text) = data.split_once(";base64,").ok_or("its data URI is not base64")?;
        return decode_base64(text).ok_or_else(|| "its data URI holds something that is not base64".into());
    }
    if uri.contains("://") {
        return Err(format!("{uri}: only files next to this one can be read"));
    }
    let base_dir = base_dir.ok_or_else(|| format!("{uri}: external files need a folder to look in"))?;
    let path = base_dir.join(percent_decode(uri).ok_or_else(|| format!("{uri}: not a valid file name"))?);
    std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))
}

/// Base 64 of RFC 4648, section 4, padded or not.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=').as_bytes();
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    let (mut bits, mut bit_count) = (0u32, 0);
    for &symbol in text {
        let value = match symbol {
            b'A'..=b'Z' => symbol - b'A',
            b'a'..=b'z' => symbol - b'a' + 26,
            b'0'..=b'9' => symbol - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        bit_count += 6;
        if bit_count >= 8 {
            bit_count -= 8;
            bytes.push((bits >> bit_count) as u8);
        }
    }
    Some(bytes)
}

/// A relative URI as a path: `%20` is a space. `None` if it is no UTF-8 afterwards.
fn percent_decode(uri: &str) -> Option<String> {
    let mut parts = uri.split('%');
    let mut bytes = parts.next()?.as_bytes().to_vec();
    for part in parts {
        let code = u8::from_str_radix(part.get(..2)?, 16).ok()?;
        bytes.push(code);
        bytes.extend(&part.as_bytes()[2..]);
    }
    String::from_utf8(bytes).ok()
}

// ---- Node transforms and their animation --------------------------------------------------------------------------

/// A node's transform relative to its parent.
#[derive(Clone, Copy)]
enum Local {
    Matrix(DAffine3),
    Parts {
        translation: DVec3,
        rotation: DQuat,
        scale: DVec3,
    },
}

impl Local {
    /// From the node's JSON.
    fn read(node: &Value) -> Result<Self, String> {
        if let Some(m) = numbers::<16>(node, "matrix") {
            let column = |i: usize| DVec3::new(m[4 * i], m[4 * i + 1], m[4 * i + 2]);
            return Ok(Self::Matrix(DAffine3 {
                matrix3: DMat3::from_cols(column(0), column(1), column(2)),
                translation: column(3),
            }));
        }
        let rotation = numbers(node, "rotation").map_or(Ok(DQuat::IDENTITY), |q| unit_quaternion(q.into()))?;
        Ok(Self::Parts {
            translation: numbers(node, "translation").map_or(DVec3::ZERO, DVec3::from_array),
            rotation,
            scale: numbers(node, "scale").map_or(DVec3::ONE, DVec3::from_array),
        })
    }

    fn affine(&self) -> DAffine3 {
        match *self {
            Self::Matrix(matrix) => matrix,
            Self::Parts {
                translation,
                rotation,
                scale,
            } => DAffine3::from_scale_rotation_translation(scale, rotation, translation),
        }
    }
}

/// The transforms of all nodes, read a second time from the text: the crate's types hold them in 32 bits, too few for
/// scenes that stand far from their origin.
fn local_transforms(root: &Root, text: &[u8]) -> Result<Vec<Local>, String> {
    let value: Value = serde_json::from_slice(text).map_err(|error| format!("broken JSON: {error}"))?;
    let read = |(index, node): (usize, &json::Node)| {
        Local::read(&value["nodes"][index])
            .map_err(|error| format!("node {:?}: {error}", label(node.name.as_ref(), index)))
    };
    root.nodes.iter().enumerate().map(read).collect()
}

/// An array of N numbers, or `None` if there is none by that name.
fn numbers<const N: usize>(node: &Value, key: &str) -> Option<[f64; N]> {
    let list: Option<Vec<f64>> = node.get(key)?.as_array()?.iter().map(Value::as_f64).collect();
    list?.try_into().ok()
}

fn unit_quaternion(q: DVec4) -> Result<DQuat, String> {
    let length = q.length();
    if length > 0.0 && length.is_finite() {
        Ok(DQuat::from_vec4(q / length))
    } else {
        Err(format!("rotation {q} has no direction"))
    }
}

/// Poses the nodes as all animations of the file do at `time`. Each repeats: its end is its beginning.
fn play_animations(file: &File<'_>, locals: &mut [Local], time: f64) -> Result<(), String> {
    for (index, animation) in file.root.animations.iter().enumerate() {
        play(file, animation, locals, time)
            .map_err(|error| format!("animation {:?}: {error}", label(animation.name.as_ref(), index)))?;
    }
    Ok(())
}

fn play(file: &File<'_>, animation: &json::Animation, locals: &mut [Local], time: f64) -> Result<(), String> {
    let times = animation.samplers.iter().map(|sampler| key_times(file, sampler));
    let times: Vec<Vec<f64>> = times.collect::<Result<_, _>>()?;
    let duration = times
        .iter()
        .filter_map(|times| times.last())
        .fold(0.0, |a: f64, &b| a.max(b));
    let time = if duration > 0.0 { time.rem_euclid(duration) } else { 0.0 };
    for channel in &animation.channels {
        let property = checked(&channel.target.path, "channel path")?;
        if property == Property::MorphTargetWeights {
            // Meshes with morph targets are refused where they are placed.
            continue;
        }
        let sampler = at(&animation.samplers, channel.sampler.value(), "sampler")?;
        let track = Track::read(file, sampler, property, at(&times, channel.sampler.value(), "sampler")?)?;
        let node = channel.target.node.value();
        let node_count = locals.len();
        let local = locals
            .get_mut(node)
            .ok_or_else(|| format!("node #{node} does not exist; the file has {node_count}"))?;
        pose(local, property, &track, time).map_err(|error| format!("node #{node}: {error}"))?;
    }
    Ok(())
}

/// Sets one property of a node from a track.
fn pose(local: &mut Local, property: Property, track: &Track<'_>, time: f64) -> Result<(), String> {
    let Local::Parts {
        translation,
        rotation,
        scale,
    } = local
    else {
        return Err("has a matrix, so its parts cannot be animated".into());
    };
    match property {
        Property::Translation => *translation = track.sample(time, DVec4::lerp).truncate(),
        Property::Scale => *scale = track.sample(time, DVec4::lerp).truncate(),
        Property::Rotation => *rotation = unit_quaternion(track.sample(time, slerp))?,
        Property::MorphTargetWeights => {}
    }
    Ok(())
}

/// The times of a sampler's keyframes, at least one, in order.
fn key_times(file: &File<'_>, sampler: &json::animation::Sampler) -> Result<Vec<f64>, String> {
    let times: Vec<f64> = file
        .floats::<1>(sampler.input.value())?
        .iter()
        .map(|t| f64::from(t[0]))
        .collect();
    let in_order = times.windows(2).all(|pair| pair[0] < pair[1]);
    if times.is_empty() || !in_order || !times.iter().all(|t| t.is_finite()) {
        return Err("its keyframe times are not an increasing list of numbers".into());
    }
    Ok(times)
}

/// Keyframes of one property.
struct Track<'a> {
    times: &'a [f64],
    /// One per keyframe; in a cubic spline three: tangent in, value, tangent out.
    values: Vec<DVec4>,
    interpolation: Interpolation,
}

impl<'a> Track<'a> {
    fn read(
        file: &File<'_>,
        sampler: &json::animation::Sampler,
        property: Property,
        times: &'a [f64],
    ) -> Result<Self, String> {
        let output = sampler.output.value();
        let values: Vec<DVec4> = if property == Property::Rotation {
            let widen = |q: [f32; 4]| DVec4::from_array(q.map(f64::from));
            file.floats(output)?.into_iter().map(widen).collect()
        } else {
            let widen = |v: [f32; 3]| DVec3::from_array(v.map(f64::from)).extend(0.0);
            file.floats(output)?.into_iter().map(widen).collect()
        };
        let interpolation = checked(&sampler.interpolation, "sampler interpolation")?;
        let values_per_key = if interpolation == Interpolation::CubicSpline {
            3
        } else {
            1
        };
        let expected = values_per_key * times.len();
        if values.len() != expected {
            return Err(format!(
                "accessor #{output} has {} values for {} keyframes; expected {expected}",
                values.len(),
                times.len()
            ));
        }
        Ok(Self {
            times,
            values,
            interpolation,
        })
    }

    /// The value at `time`; before the first and after the last keyframe it stands still. `mix` is how linear
    /// interpolation goes.
    fn sample(&self, time: f64, mix: fn(DVec4, DVec4, f64) -> DVec4) -> DVec4 {
        let next = self.times.partition_point(|&key| key <= time);
        if next == 0 || next == self.times.len() {
            return self.value(next.saturating_sub(1));
        }
        let key = next - 1;
        let span = self.times[next] - self.times[key];
        let s = (time - self.times[key]) / span;
        match self.interpolation {
            Interpolation::Step => self.value(key),
            Interpolation::Linear => mix(self.value(key), self.value(next), s),
            Interpolation::CubicSpline => {
                let tangents = (self.values[3 * key + 2] * span, self.values[3 * next] * span);
                hermite((self.value(key), self.value(next)), tangents, s)
            }
        }
    }

    fn value(&self, key: usize) -> DVec4 {
        match self.interpolation {
            Interpolation::CubicSpline => self.values[3 * key + 1],
            _ => self.values[key],
        }
    }
}

/// Spherical linear interpolation of two rotations, along the shorter arc. They are normalised here, since integers and
/// rounded decimals are not quite of unit length.
fn slerp(from: DVec4, to: DVec4, s: f64) -> DVec4 {
    let unit = |q: DVec4| DQuat::from_vec4(q.normalize_or_zero());
    DVec4::from(unit(from).slerp(unit(to), s))
}

/// The cubic through two values with given tangents over the span: glTF 2.0, appendix C.5.
fn hermite(values: (DVec4, DVec4), tangents: (DVec4, DVec4), s: f64) -> DVec4 {
    let (s2, s3) = (s * s, s * s * s);
    values.0 * (2.0 * s3 - 3.0 * s2 + 1.0)
        + tangents.0 * (s3 - 2.0 * s2 + s)
        + values.1 * (3.0 * s2 - 2.0 * s3)
        + tangents.1 * (s3 - s2)
}

// ---- The scene ----------------------------------------------------------------------------------------------------

/// Collects a scene from a file.
struct Builder<'a> {
    file: &'a File<'a>,
    scene: Scene,
    /// Scene mesh of a (mesh, primitive) of the file; `None` for points and lines.
    meshes: HashMap<(usize, usize), Option<usize>>,
    /// Scene texture of an (image, sRGB) of the file.
    textures: HashMap<(usize, bool), usize>,
    /// Scene material of primitives without one.
    default_material: Option<usize>,
}

impl<'a> Builder<'a> {
    fn new(file: &'a File<'a>) -> Self {
        Self {
            file,
            scene: Scene::default(),
            meshes: HashMap::new(),
            textures: HashMap::new(),
            default_material: None,
        }
    }

    /// All materials, so that their indices stay those of the file.
    fn add_materials(&mut self) -> Result<(), String> {
        for (index, source) in self.file.root.materials.iter().enumerate() {
            let material = self
                .material(source)
                .map_err(|error| format!("material {:?}: {error}", label(source.name.as_ref(), index)))?;
            self.scene.materials.push(material);
        }
        Ok(())
    }

    fn material(&mut self, source: &json::Material) -> Result<Material, String> {
        let extensions = source.extensions.as_ref();
        let pbr = &source.pbr_metallic_roughness;
        let strength = extensions.and_then(|e| e.emissive_strength.as_ref());
        let strength = strength.map_or(1.0, |e| e.emissive_strength.0);
        let transmission = extensions.and_then(|e| e.transmission.as_ref());
        let default = Material::default();
        let ior = extensions.and_then(|e| e.ior.as_ref());
        let [r, g, b, _] = pbr.base_color_factor.0;
        Ok(Material {
            name: source.name.clone().unwrap_or_default(),
            base_color: [r, g, b],
            base_color_texture: self.texture(pbr.base_color_texture.as_ref(), true)?,
            metallic: pbr.metallic_factor.0,
            roughness: pbr.roughness_factor.0,
            phong_exponent: None,
            multiple_scattering: false,
            metallic_roughness_texture: self.texture(pbr.metallic_roughness_texture.as_ref(), false)?,
            emission: source.emissive_factor.0.map(|e| e * strength),
            emission_texture: self.texture(source.emissive_texture.as_ref(), true)?,
            transmission: transmission.map_or(0.0, |t| t.transmission_factor.0),
            index_of_refraction: ior.map_or(default.index_of_refraction, |i| i.ior.0),
            alpha_cutoff: alpha_cutoff(source)?,
        })
    }

    /// The scene's index of a texture. An image used both as colour and as data becomes two textures.
    fn texture(&mut self, info: Option<&texture::Info>, srgb: bool) -> Result<Option<usize>, String> {
        let Some(info) = info else { return Ok(None) };
        if info.tex_coord != 0 {
            return Err(format!(
                "uses TEXCOORD_{}; only TEXCOORD_0 is available",
                info.tex_coord
            ));
        }
        let image = at(&self.file.root.textures, info.index.value(), "texture")?
            .source
            .value();
        if let Some(&index) = self.textures.get(&(image, srgb)) {
            return Ok(Some(index));
        }
        let texture = decode_image(self.file, image, srgb).map_err(|error| format!("image #{image}: {error}"))?;
        let index = self.scene.textures.len();
        self.scene.textures.push(texture);
        self.textures.insert((image, srgb), index);
        Ok(Some(index))
    }

    /// Places what hangs on the nodes of the scene, depth first. Without recursion: a file may nest at any depth.
    fn add_nodes(&mut self, locals: &[Local]) -> Result<(), String> {
        let nodes = &self.file.root.nodes;
        let mut is_placed = vec![false; nodes.len()];
        let mut to_place: Vec<(usize, DAffine3)> = Vec::new();
        to_place.extend(
            roots(&self.file.root)?
                .into_iter()
                .rev()
                .map(|root| (root, DAffine3::IDENTITY)),
        );
        while let Some((index, parent)) = to_place.pop() {
            let node = at(nodes, index, "node")?;
            let name = label(node.name.as_ref(), index);
            if std::mem::replace(&mut is_placed[index], true) {
                return Err(format!(
                    "node {name:?} is its own ancestor or has two parents; expected trees"
                ));
            }
            let transform = parent * locals[index].affine();
            self.add_node(node, transform)
                .map_err(|error| format!("node {name:?}: {error}"))?;
            let children = node.children.iter().flatten().rev();
            to_place.extend(children.map(|child| (child.value(), transform)));
        }
        Ok(())
    }

    fn add_node(&mut self, node: &json::Node, transform: DAffine3) -> Result<(), String> {
        if let Some(mesh) = node.mesh {
            if node.skin.is_some() {
                return Err("not available yet: skinned meshes".into());
            }
            self.add_instances(node, mesh.value(), transform)?;
        }
        let light = node.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
        if let Some(light) = light {
            let all = self
                .file
                .root
                .extensions
                .as_ref()
                .and_then(|e| e.khr_lights_punctual.as_ref());
            let all = all.map_or(&[][..], |e| &e.lights);
            let light = at(all, light.light.value(), "light")?;
            self.scene.lights.push(convert_light(light, node, transform)?);
        }
        if let Some(index) = node.camera {
            let camera = at(&self.file.root.cameras, index.value(), "camera")?;
            self.scene.cameras.push(convert_camera(camera, node, transform)?);
        }
        Ok(())
    }

    /// One instance for each primitive of a mesh.
    fn add_instances(&mut self, node: &json::Node, mesh_index: usize, transform: DAffine3) -> Result<(), String> {
        let source = at(&self.file.root.meshes, mesh_index, "mesh")?;
        for (index, primitive) in source.primitives.iter().enumerate() {
            let Some(mesh) = self.mesh((mesh_index, index), source, primitive)? else {
                continue;
            };
            let material = match primitive.material {
                Some(material) => material.value(),
                None => self.default_material(),
            };
            self.scene.instances.push(Instance {
                name: node.name.clone().or_else(|| source.name.clone()).unwrap_or_default(),
                transform,
                ..Instance::new(mesh, material)
            });
        }
        Ok(())
    }

    /// The scene's index of a primitive, read when it is first needed.
    fn mesh(
        &mut self,
        key: (usize, usize),
        source: &json::Mesh,
        primitive: &Primitive,
    ) -> Result<Option<usize>, String> {
        if let Some(&known) = self.meshes.get(&key) {
            return Ok(known);
        }
        let mut name = label(source.name.as_ref(), key.0);
        if source.primitives.len() > 1 {
            name = format!("{name}.{}", key.1);
        }
        let mesh = convert_primitive(self.file, primitive).map_err(|error| format!("mesh {name:?}: {error}"))?;
        let index = mesh.map(|mesh| {
            self.scene.meshes.push(Mesh { name, ..mesh });
            self.scene.meshes.len() - 1
        });
        self.meshes.insert(key, index);
        Ok(index)
    }

    /// A white Lambertian. glTF's own default is a rough metal, because `metallicFactor` defaults to 1; hardly a file
    /// without materials means that.
    fn default_material(&mut self) -> usize {
        *self.default_material.get_or_insert_with(|| {
            self.scene.materials.push(Material {
                name: "default".into(),
                ..Material::default()
            });
            self.scene.materials.len() - 1
        })
    }
}

/// Root nodes of the default scene, else of the first, else all nodes that are nobody's children.
fn roots(root: &Root) -> Result<Vec<usize>, String> {
    let scene = match root.scene {
        Some(index) => Some(at(&root.scenes, index.value(), "scene")?),
        None => root.scenes.first(),
    };
    if let Some(scene) = scene {
        return Ok(scene.nodes.iter().map(|node| node.value()).collect());
    }
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().filter_map(|node| node.children.as_ref()).flatten() {
        let count = is_child.len();
        *is_child
            .get_mut(child.value())
            .ok_or_else(|| format!("node #{} does not exist; the file has {count}", child.value()))? = true;
    }
    let roots: Vec<usize> = (0..is_child.len()).filter(|&index| !is_child[index]).collect();
    if roots.is_empty() && !is_child.is_empty() {
        return Err("every node is another one's child; expected trees".into());
    }
    Ok(roots)
}

/// The opacity that texels need, for a mask: that of the whole material, which multiplies theirs, is folded into it.
fn alpha_cutoff(source: &json::Material) -> Result<Option<f32>, String> {
    if checked(&source.alpha_mode, "alphaMode")? != AlphaMode::Mask {
        return Ok(None);
    }
    let cutoff = source.alpha_cutoff.map_or(DEFAULT_ALPHA_CUTOFF, |cutoff| cutoff.0);
    let opacity = source.pbr_metallic_roughness.base_color_factor.0[3];
    if cutoff > opacity {
        return Err(format!(
            "its opacity {opacity} is below its alphaCutoff {cutoff}, so all of it is a hole"
        ));
    }
    Ok((cutoff > 0.0).then(|| cutoff / opacity))
}

fn decode_image(file: &File<'_>, index: usize, srgb: bool) -> Result<Texture, String> {
    let source = at(&file.root.images, index, "image")?;
    let bytes = match (&source.buffer_view, &source.uri) {
        (Some(view), _) => Cow::Borrowed(file.view(view.value())?),
        (None, Some(uri)) => Cow::Owned(read_uri(uri, file.base_dir)?),
        (None, None) => return Err("names neither a bufferView nor a URI".into()),
    };
    let reader = image::ImageReader::new(Cursor::new(bytes.as_ref())).with_guessed_format();
    let image = reader.map_err(|error| error.to_string())?.decode();
    let image = image.map_err(|error| error.to_string())?.into_rgba8();
    Ok(Texture {
        name: source.name.clone().unwrap_or_default(),
        width: image.width(),
        height: image.height(),
        srgb,
        rgba: image.into_raw(),
    })
}

/// A primitive as an indexed triangle list; `None` for points and lines.
fn convert_primitive(file: &File<'_>, primitive: &Primitive) -> Result<Option<Mesh>, String> {
    let mode = checked(&primitive.mode, "primitive mode")?;
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(None);
    }
    if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
        return Err("not available yet: morph targets".into());
    }
    let attribute = |semantic: Semantic| {
        let accessor = primitive.attributes.get(&Checked::Valid(semantic));
        accessor.map(|accessor| accessor.value())
    };
    let positions = attribute(Semantic::Positions).ok_or("has no POSITION")?;
    let positions = file.floats(positions)?;
    let corners = match primitive.indices {
        Some(indices) => file.indices(indices.value())?,
        None => (0..positions.len() as u32).collect(),
    };
    let normals = attribute(Semantic::Normals)
        .map(|accessor| file.floats(accessor))
        .transpose()?;
    let tex_coords = attribute(Semantic::TexCoords(0))
        .map(|accessor| file.floats(accessor))
        .transpose()?;
    Ok(Some(Mesh {
        name: String::new(),
        positions,
        normals: normals.unwrap_or_default(),
        tex_coords: tex_coords.unwrap_or_default(),
        indices: triangle_list(mode, corners),
    }))
}

/// Three indices per triangle, wound as the mode says: glTF 2.0, section 3.7.2.1.
fn triangle_list(mode: Mode, corners: Vec<u32>) -> Vec<u32> {
    match mode {
        Mode::TriangleStrip => {
            let triangle = |(i, t): (usize, &[u32])| [t[0], t[1 + i % 2], t[2 - i % 2]];
            corners.windows(3).enumerate().flat_map(triangle).collect()
        }
        Mode::TriangleFan => {
            let rim = corners.get(1..).unwrap_or_default();
            rim.windows(2).flat_map(|edge| [edge[0], edge[1], corners[0]]).collect()
        }
        _ => corners,
    }
}

/// A light at its node, shining along the node's −Z. The node's scale bends that axis at most; `range` is ignored. The
/// extension has no extent: a number "radius" (metres; point, spot) or "angle" (half, radians; directional) among the
/// light's `extras` gives it one.
fn convert_light(light: &PunctualLight, node: &json::Node, transform: DAffine3) -> Result<Light, String> {
    let position = transform.translation;
    let direction = (transform.matrix3 * DVec3::NEG_Z).normalize_or_zero();
    let kind = match checked(&light.type_, "light type")? {
        PunctualType::Point => LightKind::Point {
            position,
            radius: extra(light, "radius")?,
        },
        PunctualType::Directional => LightKind::Directional {
            direction,
            angle: extra(light, "angle")?,
        },
        PunctualType::Spot => {
            // The extension's default cone.
            let cone = light
                .spot
                .as_ref()
                .map(|spot| (cone_angle(spot.inner_cone_angle), cone_angle(spot.outer_cone_angle)));
            let (inner_angle, outer_angle) = cone.unwrap_or((0.0, FRAC_PI_4));
            LightKind::Spot {
                position,
                direction,
                inner_angle,
                outer_angle,
                radius: extra(light, "radius")?,
            }
        }
    };
    Ok(Light {
        name: light.name.clone().or_else(|| node.name.clone()).unwrap_or_default(),
        kind,
        color: light.color,
        intensity: light.intensity,
    })
}

/// A number among the light's `extras`; 0 if there is none of this name. Its range is the scene's to check.
fn extra(light: &PunctualLight, name: &str) -> Result<f64, String> {
    let Some(raw) = &light.extras else {
        return Ok(0.0);
    };
    let extras: Value = json::deserialize::from_str(raw.get()).map_err(|error| format!("light extras: {error}"))?;
    match extras.get(name) {
        None => Ok(0.0),
        Some(value) => value
            .as_f64()
            .ok_or_else(|| format!("light extras: {name:?} is {value}, not a number")),
    }
}

/// An angle in 64 bits. π/2, the widest cone, rounds up in 32 bits, which must not make it too wide.
fn cone_angle(angle: f32) -> f64 {
    if angle == FRAC_PI_2 as f32 {
        FRAC_PI_2
    } else {
        f64::from(angle)
    }
}

fn convert_camera(camera: &json::Camera, node: &json::Node, transform: DAffine3) -> Result<Camera, String> {
    let projection = match checked(&camera.type_, "camera type")? {
        camera::Type::Perspective => {
            let lens = camera.perspective.as_ref().ok_or("its camera lacks \"perspective\"")?;
            Projection::Perspective {
                fov_y: f64::from(lens.yfov),
            }
        }
        camera::Type::Orthographic => {
            let lens = camera
                .orthographic
                .as_ref()
                .ok_or("its camera lacks \"orthographic\"")?;
            Projection::Orthographic {
                half_height: f64::from(lens.ymag),
            }
        }
    };
    Ok(Camera {
        name: node.name.clone().or_else(|| camera.name.clone()).unwrap_or_default(),
        transform: without_scale(transform),
        projection,
    })
}

/// The rotation and translation of a transform: the view direction is kept, the up axis as far as it is perpendicular.
fn without_scale(transform: DAffine3) -> DAffine3 {
    let back = transform.matrix3.z_axis.normalize_or_zero();
    let up = transform.matrix3.y_axis;
    let up = (up - back * up.dot(back)).normalize_or_zero();
    DAffine3 {
        matrix3: DMat3::from_cols(up.cross(back), up, back),
        translation: transform.translation,
    }
}

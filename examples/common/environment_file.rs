//! Environments that a command line gives: an image file, or a colour.

use super::exr_file;
use lightfall::scene::{EnvironmentImage, Light, LightKind, Scene};
use std::path::Path;

/// Lights a scene by an environment instead of its own, if it has one: an equirectangular `.exr` or `.hdr` file, or radiance as
/// `R,G,B`. `degrees` turn it, counter-clockwise seen from above.
///
/// # Errors
/// One line that says what is wrong.
pub(crate) fn add(scene: &mut Scene, text: &str, degrees: f64) -> Result<(), String> {
    let radiance: Result<Vec<f32>, _> = text.split(',').map(str::parse).collect();
    let (color, image) = match radiance.as_deref() {
        Ok(&[r, g, b]) => ([r, g, b], None),
        Ok(_) => return Err(format!("--environment {text}: expected a file, or three numbers R,G,B")),
        Err(_) => ([1.0; 3], Some(load(Path::new(text))?)),
    };
    scene.lights.retain(|l| !l.is_environment());
    scene.environments.clear();
    scene.lights.push(Light {
        name: "environment".into(),
        kind: LightKind::Environment {
            image: image.is_some().then_some(0),
            rotation: degrees.to_radians(),
        },
        color,
        intensity: 1.0,
    });
    scene.environments.extend(image);
    scene.validate().map_err(|e| format!("--environment {text}: {e}"))
}

fn load(path: &Path) -> Result<EnvironmentImage, String> {
    let name = path.display().to_string();
    let (size, rgb) = match path.extension().and_then(|e| e.to_str()) {
        Some("exr") => {
            let file = exr_file::read(path)?;
            let rgb = file.triple(["R", "G", "B"]).map_err(|e| format!("{name}: {e}"))?;
            ([file.width, file.height], rgb)
        }
        Some("hdr") => {
            let image = image::open(path).map_err(|e| format!("{name}: {e}"))?.into_rgb32f();
            let size = [image.width(), image.height()];
            let (texels, _) = image.as_raw().as_chunks();
            (size, texels.to_vec())
        }
        _ => return Err(format!("{name}: expected .exr or .hdr")),
    };
    Ok(EnvironmentImage {
        name,
        width: size[0],
        height: size[1],
        rgb,
    })
}

//! What a view looks at: the matrices, eye and purpose that the host's draws need.

use super::cube_face::{CUBE_FACES, CubeFace};
use crate::halton::radical_inverse;
use crate::scene::{Camera, Projection, UnitFrame};
use glam::{DMat4, DVec3, Mat4, Vec3, Vec4};

/// Distance of the near plane, unit frame: nearer than numbers near 1 can tell two points apart, and a power of two, so that
/// depth is that of any other to the bit but for the exponent.
pub(crate) const NEAR: f32 = 1.0 / 16_777_216.0;

/// Parallel views see from this far before the region's centre to as far behind it, unit frame. What stands further
/// towards the light does not occlude. Twin of `SURFACE_TEXEL_PARALLEL_START`.
pub(crate) const PARALLEL_REACH: f32 = 2.0;

/// What a view is for; a host may cull or pick a level of detail by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CapturePurpose {
    /// The eye: fills a G-buffer.
    Camera,
    /// A light: fills a shadow map.
    Light,
    /// A place where an environment map might be put: coarse, the lowest level of detail suffices.
    Candidate,
    /// An environment map: photons bounce off what it sees.
    EnvMap,
    /// What a point of a surface sees: some 32 pixels to a side, of which a mean is taken.
    Hemisphere,
}

/// Which instances a view wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CaptureMask {
    /// Everything.
    All,
    /// What blocks direct light.
    CastsShadow,
    /// What photons may meet.
    InEnvMaps,
}

/// One view of a frame. Positions and matrices are in the unit frame, matrices column-major.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CaptureView {
    /// Position in the list given to [`Geometry::prepare`](super::Geometry::prepare).
    pub index: u32,
    /// What the view is for.
    pub purpose: CapturePurpose,
    /// Which instances it wants.
    pub mask: CaptureMask,
    /// Unit frame to clip space: reverse-Z, far plane at infinity for perspectives.
    pub view_projection: [[f32; 4]; 4],
    /// Eye position (w = 1), or the direction of parallel rays (w = 0).
    pub eye: [f32; 4],
    /// Inward planes (n, d) of the frustum: n·x + d ≥ 0 inside. Left, right, bottom, top, near.
    pub frustum: [[f32; 4]; 5],
    /// Winding of front faces in this view.
    pub front_face: wgpu::FrontFace,
    /// Pixels that one radian (a unit length, for parallel rays) covers at the centre of the view.
    pub pixels_per_radian: f32,
}

impl CaptureView {
    /// Face `face` (0 to 5) of a cube of `size`² texels a face around `center`.
    pub fn cube_face(purpose: CapturePurpose, mask: CaptureMask, center: Vec3, face: usize, size: u32) -> Self {
        Self::perspective(purpose, mask, center, CUBE_FACES[face], 1.0, size)
    }

    /// A square perspective view of half width `tan_half` at distance 1.
    pub(crate) fn perspective(
        purpose: CapturePurpose,
        mask: CaptureMask,
        eye: Vec3,
        axes: CubeFace,
        tan_half: f32,
        size: u32,
    ) -> Self {
        let scale = 1.0 / tan_half;
        let projection = perspective_matrix(scale, scale);
        let pixels_per_radian = 0.5 * size as f32 * scale;
        Self::new(
            purpose,
            mask,
            projection * view_matrix(eye, axes),
            eye.extend(1.0),
            pixels_per_radian,
        )
    }

    /// A square parallel view around the frame's origin, `half_extent` to each side.
    pub(crate) fn parallel(
        purpose: CapturePurpose,
        mask: CaptureMask,
        axes: CubeFace,
        half_extent: f32,
        size: u32,
    ) -> Self {
        let scale = 1.0 / half_extent;
        let projection = parallel_matrix(scale, scale, PARALLEL_REACH, -PARALLEL_REACH);
        let view = view_matrix(Vec3::ZERO, axes);
        let pixels_per_radian = 0.5 * size as f32 * scale;
        Self::new(
            purpose,
            mask,
            projection * view,
            axes.forward.extend(0.0),
            pixels_per_radian,
        )
    }

    /// The upper half of a square perspective view of half width 1 at distance 1; `size` pixels wide, half as high.
    pub(crate) fn upper_half(purpose: CapturePurpose, mask: CaptureMask, eye: Vec3, axes: CubeFace, size: u32) -> Self {
        let mut projection = perspective_matrix(1.0, 2.0);
        // y from 0 to 1 at distance 1 fills the view: 2 y - 1.
        projection.z_axis.y = 1.0;
        let matrix = projection * view_matrix(eye, axes);
        Self::new(purpose, mask, matrix, eye.extend(1.0), 0.5 * size as f32)
    }

    fn new(
        purpose: CapturePurpose,
        mask: CaptureMask,
        view_projection: Mat4,
        eye: Vec4,
        pixels_per_radian: f32,
    ) -> Self {
        Self {
            index: 0,
            purpose,
            mask,
            view_projection: view_projection.to_cols_array_2d(),
            eye: eye.to_array(),
            frustum: frustum(view_projection),
            front_face: wgpu::FrontFace::Ccw,
            pixels_per_radian,
        }
    }
}

/// The eye's view: a capture view and the way back from depth to position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraView {
    /// What the host draws.
    pub capture: CaptureView,
    /// Clip space to unit frame, column-major.
    pub inverse_view_projection: [[f32; 4]; 4],
}

impl CameraView {
    /// The view of a scene camera on a target of `size` pixels. `jitter` moves the image by fractions of a pixel, for
    /// anti-aliasing by accumulation.
    pub fn new(frame: &UnitFrame, camera: &Camera, size: [u32; 2], jitter: [f64; 2]) -> Self {
        let (_, rotation, _) = camera.transform.to_scale_rotation_translation();
        let axis = |v: DVec3| (rotation * v).as_vec3();
        let axes = CubeFace {
            forward: axis(DVec3::NEG_Z),
            right: axis(DVec3::X),
            up: axis(DVec3::Y),
        };
        let eye = frame.point(camera.transform.translation);
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let (projection, eye_or_direction, pixels_per_radian) = match camera.projection {
            Projection::Perspective { fov_y } => {
                let y = 1.0 / (0.5 * fov_y).tan();
                let matrix = perspective_matrix((y / aspect) as f32, y as f32);
                (matrix, eye.extend(1.0), 0.5 * f64::from(size[1]) * y)
            }
            Projection::Orthographic { half_height } => {
                let y = frame.length_scale() / half_height;
                let reach = eye.length() + PARALLEL_REACH;
                let matrix = parallel_matrix((y / aspect) as f32, y as f32, reach, NEAR);
                (matrix, axes.forward.extend(0.0), 0.5 * f64::from(size[1]) * y)
            }
        };
        let shift = Mat4::from_translation(Vec3::new(
            (2.0 * jitter[0] / f64::from(size[0])) as f32,
            (2.0 * jitter[1] / f64::from(size[1])) as f32,
            0.0,
        ));
        let view_projection = shift * projection * view_matrix(eye, axes);
        Self::from_matrix(
            view_projection.to_cols_array_2d(),
            eye_or_direction.to_array(),
            pixels_per_radian as f32,
        )
    }

    /// Where in its pixel frame `index` of an accumulation looks, in (−1/2, 1/2)²: evenly spread over any number of
    /// frames.
    pub fn jitter(index: u32) -> [f64; 2] {
        [2, 3].map(|base| radical_inverse(index.wrapping_add(1), base) - 0.5)
    }

    /// A host's own view: unit frame to clip space (any depth convention that its G-buffer uses), and the eye position
    /// (w = 1) or view direction (w = 0). The inverse is taken in `f64`.
    pub fn from_matrix(view_projection: [[f32; 4]; 4], eye: [f32; 4], pixels_per_radian: f32) -> Self {
        let matrix = Mat4::from_cols_array_2d(&view_projection);
        let capture = CaptureView::new(
            CapturePurpose::Camera,
            CaptureMask::All,
            matrix,
            Vec4::from(eye),
            pixels_per_radian,
        );
        let inverse = DMat4::from_cols_array_2d(&view_projection.map(|c| c.map(f64::from))).inverse();
        Self {
            capture,
            inverse_view_projection: inverse.to_cols_array_2d().map(|c| c.map(|x| x as f32)),
        }
    }
}

/// Infinite reverse-Z: depth is `NEAR` / distance along the axis.
fn perspective_matrix(x_scale: f32, y_scale: f32) -> Mat4 {
    Mat4::from_cols(
        Vec4::new(x_scale, 0.0, 0.0, 0.0),
        Vec4::new(0.0, y_scale, 0.0, 0.0),
        Vec4::new(0.0, 0.0, 0.0, -1.0),
        Vec4::new(0.0, 0.0, NEAR, 0.0),
    )
}

/// Reverse-Z parallel projection: depth 1 at `near`, 0 at `far`, both measured along the view axis.
fn parallel_matrix(x_scale: f32, y_scale: f32, far: f32, near: f32) -> Mat4 {
    let range = 1.0 / (far - near);
    Mat4::from_cols(
        Vec4::new(x_scale, 0.0, 0.0, 0.0),
        Vec4::new(0.0, y_scale, 0.0, 0.0),
        Vec4::new(0.0, 0.0, range, 0.0),
        Vec4::new(0.0, 0.0, far * range, 1.0),
    )
}

/// World (unit frame) to view: x right, y up, looking along −z.
fn view_matrix(eye: Vec3, axes: CubeFace) -> Mat4 {
    let (r, u, f) = (axes.right, axes.up, axes.forward);
    Mat4::from_cols(
        Vec4::new(r.x, u.x, -f.x, 0.0),
        Vec4::new(r.y, u.y, -f.y, 0.0),
        Vec4::new(r.z, u.z, -f.z, 0.0),
        Vec4::new(-r.dot(eye), -u.dot(eye), f.dot(eye), 1.0),
    )
}

/// Planes of the clip volume: −w ≤ x, y ≤ w and z ≤ w (reverse-Z near). Not normalised.
fn frustum(matrix: Mat4) -> [[f32; 4]; 5] {
    let (x, y, z, w) = (matrix.row(0), matrix.row(1), matrix.row(2), matrix.row(3));
    [w + x, w - x, w + y, w - y, w - z].map(|plane| plane.to_array())
}

/// Two axes perpendicular to a direction, the same for the same direction.
pub(crate) fn axes_along(direction: DVec3) -> CubeFace {
    let forward = direction.normalize();
    let helper = if forward.y.abs() < 0.9 { DVec3::Y } else { DVec3::Z };
    let right = forward.cross(helper).normalize();
    CubeFace {
        forward: forward.as_vec3(),
        right: right.as_vec3(),
        up: right.cross(forward).as_vec3(),
    }
}

/// The matrix applied to a point, homogeneous; for tests and the host's own checks.
#[cfg(test)]
fn project(view: &CameraView, p: Vec3) -> Vec4 {
    Mat4::from_cols_array_2d(&view.capture.view_projection) * p.extend(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneBounds;
    use glam::DAffine3;

    fn frame() -> UnitFrame {
        UnitFrame::new(&SceneBounds::new(DVec3::splat(-1.0), DVec3::splat(1.0)).unwrap(), 1.0).unwrap()
    }

    fn camera(projection: Projection) -> Camera {
        Camera {
            name: String::new(),
            transform: DAffine3::from_translation(DVec3::new(0.0, 0.0, 4.0)),
            projection,
        }
    }

    #[test]
    fn depth_leads_back_to_the_position() {
        for projection in [
            Projection::Perspective { fov_y: 0.9 },
            Projection::Orthographic { half_height: 2.0 },
        ] {
            let view = CameraView::new(&frame(), &camera(projection), [640, 480], [0.0; 2]);
            let p = Vec3::new(0.2, -0.1, 0.3);
            let clip = project(&view, p);
            let ndc = clip.truncate() / clip.w;
            assert!(ndc.z > 0.0 && ndc.z < 1.0, "{ndc}");
            let back = Mat4::from_cols_array_2d(&view.inverse_view_projection) * ndc.extend(1.0);
            assert!((back.truncate() / back.w - p).length() < 2e-6, "{projection:?}");
        }
    }

    #[test]
    fn jitter_moves_the_image_by_that_share_of_a_pixel() {
        let projection = Projection::Perspective { fov_y: 0.9 };
        let still = CameraView::new(&frame(), &camera(projection), [100, 50], [0.0; 2]);
        let moved = CameraView::new(&frame(), &camera(projection), [100, 50], [0.5, -0.25]);
        let at = |v: &CameraView| {
            let c = project(v, Vec3::new(0.1, 0.2, 0.0));
            c.truncate().truncate() / c.w * glam::Vec2::new(50.0, 25.0)
        };
        assert!((at(&moved) - at(&still) - glam::Vec2::new(0.5, -0.25)).length() < 1e-4);
    }

    #[test]
    fn the_frustum_holds_what_is_in_front_and_leaves_out_what_is_not() {
        let view = CameraView::new(
            &frame(),
            &camera(Projection::Perspective { fov_y: 0.9 }),
            [64, 64],
            [0.0; 2],
        );
        let inside = |p: Vec3| {
            view.capture
                .frustum
                .iter()
                .all(|q| Vec4::from(*q).dot(p.extend(1.0)) >= 0.0)
        };
        assert!(inside(Vec3::ZERO));
        assert!(!inside(Vec3::new(0.0, 0.0, 3.0)), "behind the eye");
        assert!(!inside(Vec3::new(5.0, 0.0, 0.0)), "beside it");
    }
}

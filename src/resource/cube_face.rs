//! Cube faces addressed by hand, so that texel centres and seams are exact. Twin of `shaders/common/cube_face.wgsl`.

use glam::Vec3;

/// The axes of one face: a right-handed camera (`right` × `up` = −`forward`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubeFace {
    /// Where the face's camera looks.
    pub forward: Vec3,
    /// Towards larger u.
    pub right: Vec3,
    /// Towards smaller v (rows run down).
    pub up: Vec3,
}

const fn face(forward: Vec3, right: Vec3, up: Vec3) -> CubeFace {
    CubeFace { forward, right, up }
}

/// The faces in layer order: +X, −X, +Y, −Y, +Z, −Z.
pub const CUBE_FACES: [CubeFace; 6] = [
    face(Vec3::X, Vec3::Z, Vec3::Y),
    face(Vec3::NEG_X, Vec3::NEG_Z, Vec3::Y),
    face(Vec3::Y, Vec3::X, Vec3::Z),
    face(Vec3::NEG_Y, Vec3::NEG_X, Vec3::Z),
    face(Vec3::Z, Vec3::NEG_X, Vec3::Y),
    face(Vec3::NEG_Z, Vec3::X, Vec3::Y),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_face_is_a_right_handed_camera() {
        for face in CUBE_FACES {
            assert_eq!(face.right.cross(face.up), -face.forward);
            assert_eq!(face.forward.cross(face.up), face.right);
        }
    }
}

//! Which faces of environment maps may show something new, where the host says what has changed.

use crate::resource::cube_face::CUBE_FACES;
use crate::scene::{SceneBounds, UnitFrame};
use glam::Vec3;

/// What environment maps hold, and what has changed since.
#[derive(Debug, Default)]
pub(super) struct Recapture {
    /// Where the maps were captured last, and in which frame; `None`: not yet.
    captured: Option<(UnitFrame, Vec<Vec3>)>,
    /// Regions that changed since the last frame; `None`: the host did not say.
    changes: Option<Vec<SceneBounds>>,
    /// Layers to capture that were planned and not recorded yet.
    pending: Vec<u32>,
}

impl Recapture {
    /// What the maps hold is void.
    pub(super) fn forget(&mut self) {
        self.captured = None;
    }

    /// Notes what has changed since the last frame.
    pub(super) fn set_changes(&mut self, changes: &[SceneBounds]) {
        self.changes.get_or_insert_default().extend_from_slice(changes);
    }

    /// Whether the host said that nothing changed since the last frame.
    pub(super) fn is_still(&self) -> bool {
        self.changes.as_ref().is_some_and(Vec::is_empty)
    }

    /// Layers to capture this frame, in order; what has changed is taken.
    pub(super) fn layers(&mut self, frame: &UnitFrame, centers: &[Vec3]) -> Vec<u32> {
        let changes = self.changes.take();
        let last = self.captured.replace((*frame, centers.to_vec()));
        let (Some(changes), Some((last_frame, last_centers))) = (changes, last) else {
            self.pending = (0..6 * centers.len() as u32).collect();
            return self.pending.clone();
        };
        let boxes: Vec<_> = changes
            .iter()
            .map(|change| [frame.point(change.min), frame.point(change.max)])
            .collect();
        let is_kept = |map: usize| last_frame.maps_like(frame) && last_centers.get(map) == centers.get(map);
        self.pending = (0..6 * centers.len() as u32)
            .filter(|layer| {
                let (map, face) = (*layer as usize / 6, *layer as usize % 6);
                let shows_change = || boxes.iter().any(|corners| may_show(centers[map], face, corners));
                !is_kept(map) || self.pending.contains(layer) || shows_change()
            })
            .collect();
        self.pending.clone()
    }

    /// Notes that the layers planned last were recorded.
    pub(super) fn recorded(&mut self) {
        self.pending.clear();
    }
}

/// Whether a box may be seen on a face of the map at `center`: unless all of it lies beyond one side of the face's pyramid.
fn may_show(center: Vec3, face: usize, corners: &[Vec3; 2]) -> bool {
    let axes = &CUBE_FACES[face];
    let sides = [axes.right, -axes.right, axes.up, -axes.up].map(|side| axes.forward - side);
    sides.into_iter().all(|inward| {
        // The corner furthest inward.
        let corner = Vec3::select(inward.cmpgt(Vec3::ZERO), corners[1], corners[0]);
        inward.dot(corner - center) >= 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn cube(center: DVec3, half: f64) -> SceneBounds {
        SceneBounds::new(center - half, center + half).unwrap()
    }

    /// The layers of a frame that is recorded.
    fn recorded(recapture: &mut Recapture, frame: &UnitFrame, centers: &[Vec3]) -> Vec<u32> {
        let layers = recapture.layers(frame, centers);
        recapture.recorded();
        layers
    }

    fn frame() -> UnitFrame {
        UnitFrame::new(&cube(DVec3::ZERO, 0.5), 1.0).unwrap()
    }

    #[test]
    fn without_a_word_of_the_host_everything_is_captured_each_frame() {
        let mut recapture = Recapture::default();
        for _ in 0..3 {
            assert_eq!(recorded(&mut recapture, &frame(), &[Vec3::ZERO, Vec3::X]).len(), 12);
        }
    }

    #[test]
    fn only_faces_towards_what_changed_are_captured_again() {
        let mut recapture = Recapture::default();
        let centers = [Vec3::ZERO, Vec3::new(0.4, 0.0, 0.0)];
        recapture.set_changes(&[]);
        assert_eq!(
            recorded(&mut recapture, &frame(), &centers).len(),
            12,
            "there was nothing yet"
        );
        recapture.set_changes(&[]);
        assert!(recorded(&mut recapture, &frame(), &centers).is_empty());
        // Between the two maps: +X of the first, -X of the second.
        recapture.set_changes(&[cube(DVec3::new(0.2, 0.0, 0.0), 0.02)]);
        assert_eq!(recorded(&mut recapture, &frame(), &centers), [0, 7]);
        // Over the edge between +X and +Y of both, and around the second map: all its faces.
        recapture.set_changes(&[cube(DVec3::new(0.4, 0.0, 0.0), 0.01), cube(DVec3::splat(0.3), 0.01)]);
        assert_eq!(
            recorded(&mut recapture, &frame(), &centers),
            [0, 2, 4, 6, 7, 8, 9, 10, 11]
        );
    }

    #[test]
    fn what_was_planned_and_not_recorded_is_planned_again() {
        let mut recapture = Recapture::default();
        let centers = [Vec3::ZERO, Vec3::new(0.4, 0.0, 0.0)];
        recapture.layers(&frame(), &centers);
        recapture.set_changes(&[]);
        assert_eq!(recorded(&mut recapture, &frame(), &centers).len(), 12);
        recapture.set_changes(&[cube(DVec3::new(0.2, 0.0, 0.0), 0.02)]);
        recapture.layers(&frame(), &centers);
        recapture.set_changes(&[]);
        assert_eq!(recorded(&mut recapture, &frame(), &centers), [0, 7]);
        recapture.set_changes(&[]);
        assert!(recorded(&mut recapture, &frame(), &centers).is_empty());
    }

    #[test]
    fn maps_that_moved_and_frames_that_changed_are_captured_whole() {
        let mut recapture = Recapture::default();
        recorded(&mut recapture, &frame(), &[Vec3::ZERO, Vec3::X]);
        recapture.set_changes(&[]);
        assert_eq!(
            recorded(&mut recapture, &frame(), &[Vec3::ZERO, Vec3::Y, Vec3::Z]),
            Vec::from_iter(6..18)
        );
        recapture.set_changes(&[]);
        let other = UnitFrame::new(&cube(DVec3::ONE, 0.5), 1.0).unwrap();
        assert_eq!(recorded(&mut recapture, &other, &[Vec3::ZERO]).len(), 6);
        recapture.set_changes(&[]);
        recapture.forget();
        assert_eq!(recorded(&mut recapture, &other, &[Vec3::ZERO]).len(), 6);
    }
}

//! When the tables of where photons start are brought up to date: for some frames after what the views show has changed, so
//! that a scene at rest is the same in every frame.

use crate::resource::CameraView;

/// Frames that a table follows what is seen of its photons.
const UPDATES: u32 = 8;

#[derive(Debug, Default)]
pub(super) struct EmissionSchedule {
    /// Count of changes of light and geometry, and for each camera its eye and what its depth is measured along; that is the
    /// same whatever the jitter.
    subject: Option<(u64, Vec<[[f32; 4]; 2]>)>,
    updates: u32,
}

impl EmissionSchedule {
    /// Notes what this frame's views show.
    pub(super) fn follow(&mut self, revision: u64, cameras: &[CameraView]) {
        let camera = |c: &CameraView| [c.capture.eye, c.capture.view_projection.map(|column| column[3])];
        let subject = (revision, cameras.iter().map(camera).collect());
        if self.subject.as_ref() != Some(&subject) {
            self.subject = Some(subject);
            self.updates = UPDATES;
        }
    }

    /// Whether tables are updated this frame, once a frame.
    pub(super) fn take_update(&mut self) -> bool {
        let is_due = self.updates > 0;
        self.updates = self.updates.saturating_sub(1);
        is_due
    }

    /// Whether views are to count for the next update.
    pub(super) fn counts(&self) -> bool {
        self.updates > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Projection, SceneBounds, UnitFrame};
    use glam::{DAffine3, DVec3};

    fn view(x: f64, jitter: [f64; 2]) -> CameraView {
        let frame = UnitFrame::new(&SceneBounds::new(DVec3::splat(-1.0), DVec3::splat(1.0)).unwrap(), 1.0).unwrap();
        let camera = Camera {
            name: String::new(),
            transform: DAffine3::from_translation(DVec3::new(x, 0.0, 4.0)),
            projection: Projection::Perspective { fov_y: 0.9 },
        };
        CameraView::new(&frame, &camera, [64, 48], jitter)
    }

    #[test]
    fn tables_rest_some_frames_after_a_change() {
        let mut schedule = EmissionSchedule::default();
        let mut updates = |revision, x| {
            let frames = (0..2 * UPDATES).map(|i| {
                schedule.follow(revision, &[view(x, CameraView::jitter(i))]);
                u32::from(schedule.take_update())
            });
            frames.sum::<u32>()
        };
        assert_eq!(updates(0, 0.0), UPDATES);
        assert_eq!(updates(0, 0.0), 0);
        assert_eq!(updates(1, 0.0), UPDATES, "a light has changed");
        assert_eq!(updates(1, 0.5), UPDATES, "the camera has moved");
    }
}

//! When the tables of where photons go are brought up to date: for some frames after what the views show has changed, so
//! that a scene at rest is the same in every frame.

use crate::resource::CameraView;
use glam::{Mat4, Vec4};

/// Frames that a table follows what is seen of its photons.
const UPDATES: u32 = 8;

/// Share of its length that a row of a view's matrix may change by: what taking out the jitter leaves.
const ROUNDING: f32 = 1e-5;

#[derive(Debug, Default)]
pub(super) struct GuidingSchedule {
    /// Count of changes of light and geometry, and the views.
    subject: Option<(u64, Vec<CameraView>)>,
    updates: u32,
}

impl GuidingSchedule {
    /// Notes what this frame's views show.
    pub(super) fn follow(&mut self, revision: u64, cameras: &[CameraView]) {
        let is_same = |(of, views): &(u64, Vec<CameraView>)| {
            let pairs = views.iter().zip(cameras);
            *of == revision && views.len() == cameras.len() && pairs.into_iter().all(|(a, b)| show_the_same(a, b))
        };
        if !self.subject.as_ref().is_some_and(is_same) {
            self.subject = Some((revision, cameras.to_vec()));
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

/// Whether two views differ by jitter alone: it adds to the rows of x and y a part of that of w, so little that the image moves
/// by no more than a pixel.
fn show_the_same(a: &CameraView, b: &CameraView) -> bool {
    let [rows_a, rows_b] = [a, b].map(|view| {
        let matrix = Mat4::from_cols_array_2d(&view.capture.view_projection);
        [matrix.row(0), matrix.row(1), matrix.row(3)]
    });
    let w = rows_a[2];
    let is_same = |a_row: Vec4, b_row: Vec4| {
        let apart = b_row - a_row;
        let part = apart.dot(w) / w.length_squared();
        // A pixel's width in normalised device coordinates.
        let pixel = a_row.truncate().length() / a.capture.pixels_per_radian;
        part.abs() <= pixel && (apart - part * w).length() <= ROUNDING * a_row.length()
    };
    let is_alike = a.capture.eye == b.capture.eye && a.capture.pixels_per_radian == b.capture.pixels_per_radian;
    is_alike && w == rows_b[2] && (0..2).all(|axis| is_same(rows_a[axis], rows_b[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Projection, SceneBounds, UnitFrame};
    use glam::{DAffine3, DVec3};

    fn view(projection: Projection, transform: DAffine3, jitter: [f64; 2]) -> CameraView {
        let frame = UnitFrame::new(&SceneBounds::new(DVec3::splat(-1.0), DVec3::splat(1.0)).unwrap(), 1.0).unwrap();
        let camera = Camera {
            name: String::new(),
            transform,
            projection,
        };
        CameraView::new(&frame, &camera, [64, 48], jitter)
    }

    #[test]
    fn tables_rest_some_frames_after_a_change() {
        let at = |x| DAffine3::from_translation(DVec3::new(x, 0.3, 4.0));
        let lens = |fov_y| Projection::Perspective { fov_y };
        let map = |half_height| Projection::Orthographic { half_height };
        let mut schedule = GuidingSchedule::default();
        let mut updates = |revision, projection, transform| {
            let frames = (0..2 * UPDATES).map(|i| {
                schedule.follow(revision, &[view(projection, transform, CameraView::jitter(i))]);
                u32::from(schedule.take_update())
            });
            frames.sum::<u32>()
        };
        assert_eq!(updates(0, lens(0.9), at(0.0)), UPDATES);
        assert_eq!(updates(0, lens(0.9), at(0.0)), 0);
        assert_eq!(updates(1, lens(0.9), at(0.0)), UPDATES, "a light has changed");
        assert_eq!(updates(1, lens(0.9), at(0.5)), UPDATES, "the camera has moved");
        assert_eq!(updates(1, lens(0.8), at(0.5)), UPDATES, "it sees less");
        let rolled = at(0.5) * DAffine3::from_rotation_z(0.1);
        assert_eq!(updates(1, lens(0.8), rolled), UPDATES, "it leans");
        assert_eq!(updates(1, map(1.0), at(0.5)), UPDATES, "it sees parallel rays");
        assert_eq!(updates(1, map(1.0), at(0.5)), 0);
        assert_eq!(updates(1, map(1.0), at(0.6)), UPDATES, "it pans");
        assert_eq!(updates(1, map(0.9), at(0.6)), UPDATES, "it sees less");
    }
}

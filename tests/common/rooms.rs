//! The sample of two rooms, with a bulb and a block in each.

use lightfall::glam::{DAffine3, DVec3};
use lightfall::scene::{Instance, Light, LightKind, Scene, samples};

/// Two rooms with a bulb in each, and a door between them, which is closed at 0 and open at 1.
pub(crate) fn with_bulbs(time: f64) -> Scene {
    let mut scene = samples::two_rooms(time);
    let near = *bulb(&mut scene, 0);
    let far = DVec3::new(near.x, near.y, -near.z);
    scene.lights.push(Light::point(far, 20.0, [1.0, 0.9, 0.75]));
    scene
}

/// The same with a block of half a door's size in each room: "near block", "far block".
pub(crate) fn with_blocks(time: f64) -> Scene {
    let mut scene = with_bulbs(time);
    let door = scene.instances.iter().find(|i| i.name == "door").unwrap().clone();
    for (name, z) in [("near block", -2.5), ("far block", 2.5)] {
        scene.instances.push(Instance {
            name: name.into(),
            transform: block_at(0.5, z, 0.5),
            ..door.clone()
        });
    }
    scene
}

/// Where a bulb hangs: 0 in the near room, 1 in the far one.
pub(crate) fn bulb(scene: &mut Scene, index: usize) -> &mut DVec3 {
    match &mut scene.lights[index].kind {
        LightKind::Point { position, .. } => position,
        _ => panic!("light {index} of the rooms is a bulb"),
    }
}

/// A block of this size on the floor.
pub(crate) fn block_at(x: f64, z: f64, size: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, 0.0, z)) * DAffine3::from_scale(DVec3::new(size, 0.5 * size, 6.0 * size))
}

/// Puts a block there.
pub(crate) fn move_block(scene: &mut Scene, name: &str, transform: DAffine3) {
    let block = scene.instances.iter_mut().find(|i| i.name == name);
    block.unwrap().transform = transform;
}

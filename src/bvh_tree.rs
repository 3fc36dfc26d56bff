//! Beside the layers, for any of them: trees over boxes, binary ones built by the surface-area heuristic, collapsed by `obvhs`
//! into compressed nodes of eight children (Ylitie et al. 2017).
//!
//! The binary tree is built here, from the top down (Wald 2007, "On fast construction of SAH-based bounding volume
//! hierarchies"), and not by `obvhs`: its clustering from the bottom up takes quadratic time and as many levels as boxes
//! where boxes coincide or enclose one another, which duplicated geometry and fans of triangles do (`docs/tracing.md`).

use crate::Error;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::cwbvh::node::CwBvhNode;
use std::collections::VecDeque;

/// Boxes in a leaf at most: what a compressed node has bits for.
const LEAF: u32 = 3;
/// Places along each axis at which a split is tried.
const BINS: usize = 16;
/// Levels of a binary tree at first. Parts that would become deeper are halved by count.
const BINARY_LEVELS: u32 = 48;
/// Levels that a binary tree may have after some of it has been put elsewhere.
const DEEPEST: u32 = 256;
/// Nodes, the uppermost ones and at most [`REINSERTED_PART`] of all, that are taken out and put back where they cost rays
/// least (Meister and Bittner 2018), in each of sixteen rounds of ever fewer. It saves rays through Sponza a tenth of their
/// nodes and shadow rays a quarter (`docs/tracing.md`). More hardly help, and where boxes overlap much each takes time in
/// proportion to all of them.
const REINSERTED: f32 = 1024.0;
const REINSERTED_PART: f32 = 0.02;
/// Boxes are taken to be larger than they are by this part of what all of them extend over, and not by less than some
/// neighbouring numbers are apart: where boxes have no area the heuristic cannot tell a good tree from a bad one.
const MARGIN: f32 = 1.0 / (1 << 20) as f32;
/// Smaller extents count as this, so that neither their inverses nor their squares leave the range of `f32`.
const SMALLEST: f32 = 1e-12;

/// The shape of a tree. Its nodes have no bounds until [`fit`] gives them some.
pub(crate) struct Tree {
    pub(crate) nodes: Vec<CwBvhNode>,
    /// Which box stands at each place of the leaves.
    pub(crate) order: Vec<u32>,
}

impl Tree {
    /// A tree of so many levels at most over boxes. Takes some 300 bytes a box while it works.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`], which `what` names, if there are too many boxes for that.
    pub(crate) fn over(
        boxes: impl ExactSizeIterator<Item = Aabb> + Clone,
        levels: u32,
        what: impl Fn() -> String,
    ) -> Result<Self, Error> {
        if boxes.len() == 0 {
            return Ok(Self {
                nodes: vec![CwBvhNode::default()],
                order: Vec::new(),
            });
        }
        // The first will do but for boxes that only a lopsided tree suits, such as nested ones.
        for (binary_levels, is_improved) in [(BINARY_LEVELS, true), (BINARY_LEVELS, false), (levels, false)] {
            let mut binary = binary_tree_of(boxes.clone(), binary_levels);
            if is_improved {
                let part = (REINSERTED / binary.nodes.len() as f32).min(REINSERTED_PART);
                ReinsertionOptimizer::default().run(&mut binary, part, None);
            }
            // What collapses the tree recurses as deep as it is.
            if levels_of(&binary) > DEEPEST {
                continue;
            }
            let wide = bvh2_to_cwbvh(&binary, LEAF, true, false);
            let tree = Self {
                nodes: wide.nodes,
                order: wide.primitive_indices,
            };
            if tree.levels() <= levels {
                return Ok(tree);
            }
        }
        Err(Error::LimitExceeded {
            what: format!("levels of the tree over {}", what()),
            needed: u64::from(boxes.len().ilog2()),
            limit: u64::from(levels),
            remedy: "split it",
        })
    }

    fn levels(&self) -> u32 {
        let mut levels = vec![1; self.nodes.len()];
        // Children stand behind their parents.
        for (index, node) in self.nodes.iter().enumerate() {
            for child in 0..node.imask.count_ones() {
                levels[(node.child_base_idx + child) as usize] = levels[index] + 1;
            }
        }
        levels.into_iter().max().unwrap_or(0)
    }
}

/// A box and which one it is.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    index: u32,
}

/// A tree of two children a node, for rays that the processor follows.
pub(crate) fn binary_tree(boxes: impl ExactSizeIterator<Item = Aabb>) -> Bvh2 {
    match boxes.len() {
        0 => Bvh2::default(),
        _ => binary_tree_of(boxes, BINARY_LEVELS),
    }
}

fn binary_tree_of(boxes: impl Iterator<Item = Aabb>, levels: u32) -> Bvh2 {
    let mut items: Vec<_> = (0..).zip(boxes).map(|(index, bounds)| Item { bounds, index }).collect();
    let all = union(&items);
    let reach = all.min.abs().max(all.max.abs()).max_element();
    let margin = (MARGIN * all.diagonal().max_element())
        .max(2.0 * f32::EPSILON * reach)
        .max(SMALLEST);
    for item in &mut items {
        item.bounds = Aabb::new(item.bounds.min - margin, item.bounds.max + margin);
    }
    let mut nodes = Vec::with_capacity(2 * items.len() - 1);
    nodes.push(Bvh2Node::default());
    // Level by level: what is put elsewhere is chosen from the first nodes.
    let mut open = VecDeque::from([(0, 0..items.len(), 1)]);
    while let Some((node, range, level)) = open.pop_front() {
        let own = &mut items[range.clone()];
        let bounds = union(own);
        if let [_] = own {
            nodes[node] = Bvh2Node::new(bounds, 1, range.start as u32);
            continue;
        }
        let levels_left = levels.saturating_sub(level);
        let must_halve = own.len().next_power_of_two().trailing_zeros() >= levels_left;
        let middle = range.start + if must_halve { halve(own) } else { split(own) };
        let first = nodes.len();
        nodes[node] = Bvh2Node::new(bounds, 0, first as u32);
        nodes.extend([Bvh2Node::default(); 2]);
        open.push_back((first, range.start..middle, level + 1));
        open.push_back((first + 1, middle..range.end, level + 1));
    }
    Bvh2 {
        nodes,
        primitive_indices: items.iter().map(|item| item.index).collect(),
        ..Bvh2::default()
    }
}

fn levels_of(tree: &Bvh2) -> u32 {
    let mut deepest = 0;
    let mut open = vec![(0, 1)];
    while let Some((node, level)) = open.pop() {
        deepest = deepest.max(level);
        let node = &tree.nodes[node as usize];
        if !node.is_leaf() {
            open.extend([0, 1].map(|k| (node.first_index + k, level + 1)));
        }
    }
    deepest
}

fn union(items: &[Item]) -> Aabb {
    items.iter().fold(Aabb::INVALID, |all, item| all.union(&item.bounds))
}

/// Sorts items into two halves at the middle of the axis along which they spread most.
fn halve(items: &mut [Item]) -> usize {
    let mut centers = Aabb::INVALID;
    items.iter().for_each(|item| {
        centers.extend(item.bounds.center());
    });
    let (axis, middle) = (centers.largest_axis(), items.len() / 2);
    let place = |item: &Item| item.bounds.center_axis(axis);
    items.select_nth_unstable_by(middle, |a, b| place(a).total_cmp(&place(b)));
    middle
}

/// What falls between two planes.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: u32,
}

impl Bin {
    const EMPTY: Self = Self {
        bounds: Aabb::INVALID,
        count: 0,
    };

    fn add(&mut self, other: &Self) {
        self.bounds = self.bounds.union(&other.bounds);
        self.count += other.count;
    }

    /// Expected tests of boxes by rays that meet the box around all, times its area.
    fn cost(&self) -> f32 {
        self.bounds.half_area() * self.count as f32
    }
}

/// Sorts items to the two sides of the plane that rays are expected to find cheapest; into halves where none divides them.
fn split(items: &mut [Item]) -> usize {
    let mut centers = Aabb::INVALID;
    for item in items.iter() {
        centers.extend(item.bounds.center());
    }
    let extent = centers.diagonal();
    // So that the last center falls into the last bin and not behind it.
    let scale = (BINS as f32 - 0.01) / extent.max(Vec3A::splat(SMALLEST));
    let bin_of = |item: &Item| ((item.bounds.center() - centers.min) * scale).as_uvec3();
    let mut bins = [[Bin::EMPTY; BINS]; 3];
    for item in items.iter() {
        let one = Bin {
            bounds: item.bounds,
            count: 1,
        };
        let place = bin_of(item).to_array();
        for axis in 0..3 {
            bins[axis][place[axis] as usize].add(&one);
        }
    }
    let cheapest = (0..3)
        .filter(|&axis| extent[axis] > SMALLEST)
        .flat_map(|axis| planes(&bins[axis]).map(move |(cost, plane)| (cost, axis, plane)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, axis, plane)) = cheapest else {
        return items.len() / 2;
    };
    partition(items, |item| bin_of(item)[axis] < plane)
}

/// Planes with items on both sides: cost, and the first bin behind it.
fn planes(bins: &[Bin; BINS]) -> impl Iterator<Item = (f32, u32)> {
    let mut behind = [Bin::EMPTY; BINS];
    let mut sum = Bin::EMPTY;
    for plane in (1..BINS).rev() {
        sum.add(&bins[plane]);
        behind[plane] = sum;
    }
    let mut before = Bin::EMPTY;
    (1..BINS).filter_map(move |plane| {
        before.add(&bins[plane - 1]);
        let divides = before.count > 0 && behind[plane].count > 0;
        divides.then(|| (before.cost() + behind[plane].cost(), plane as u32))
    })
}

/// Brings the items for which `is_before` holds to the front, and says how many they are.
fn partition(items: &mut [Item], is_before: impl Fn(&Item) -> bool) -> usize {
    let mut middle = 0;
    for index in 0..items.len() {
        if is_before(&items[index]) {
            items.swap(index, middle);
            middle += 1;
        }
    }
    middle
}

/// Gives every node the bounds of what is below it, `leaf(place)` of what stands at a place of the leaves. Returns those of
/// the whole; `None` without leaves.
pub(crate) fn fit(nodes: &mut [CwBvhNode], leaf: impl Fn(usize) -> Aabb) -> Option<Aabb> {
    let mut bounds = vec![Aabb::INVALID; nodes.len()];
    // Children stand behind their parents.
    for (index, node) in nodes.iter_mut().enumerate().rev() {
        let children = std::array::from_fn(|child| {
            if node.is_child_empty(child) {
                return None;
            }
            if !node.is_leaf(child) {
                return Some(bounds[node.child_node_index(child) as usize]);
            }
            let (first, count) = node.child_primitives(child);
            Some((first..first + count).fold(Aabb::INVALID, |all, place| all.union(&leaf(place as usize))))
        });
        let all = children.iter().flatten().fold(Aabb::INVALID, |all, one| all.union(one));
        if all.valid() {
            quantise(node, &all, &children);
        }
        bounds[index] = all;
    }
    Some(bounds[0]).filter(Aabb::valid)
}

/// Writes bounds into a node: its lower corner, a power of two for each axis, and eight bits for each plane of each child,
/// rounded outward.
fn quantise(node: &mut CwBvhNode, bounds: &Aabb, children: &[Option<Aabb>; 8]) {
    const STEPS: f32 = 255.0;
    let exponents = (bounds.diagonal() / STEPS).to_array().map(exponent_above);
    let step = Vec3A::from(exponents.map(|e| f32::from_bits(u32::from(e) << 23)));
    node.p = bounds.min.into();
    node.e = exponents;
    for (child, of_child) in children.iter().enumerate() {
        let Some(of_child) = of_child else {
            continue;
        };
        let planes = |p: Vec3A| (p - bounds.min) / step;
        let low = planes(of_child.min).floor().clamp(Vec3A::ZERO, Vec3A::splat(STEPS));
        let high = planes(of_child.max).ceil().clamp(Vec3A::ZERO, Vec3A::splat(STEPS));
        let planes = [
            (&mut node.child_min_x, &mut node.child_max_x, low.x, high.x),
            (&mut node.child_min_y, &mut node.child_max_y, low.y, high.y),
            (&mut node.child_min_z, &mut node.child_max_z, low.z, high.z),
        ];
        for (min, max, low, high) in planes {
            min[child] = low as u8;
            max[child] = high as u8;
        }
    }
}

/// The exponent, as `f32` stores it, of the smallest power of two that is not below `x`; of 2^-100 if that is larger.
fn exponent_above(x: f32) -> u8 {
    const MANTISSA: u32 = (1 << 23) - 1;
    ((x.max(2f32.powi(-100)).to_bits() + MANTISSA) >> 23) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes that are hard to divide, by name.
    fn boxes(count: u32) -> [(&'static str, Vec<Aabb>); 7] {
        let part = |i: u32| i as f32 / count as f32;
        let all = |at: &dyn Fn(u32) -> Aabb| (0..count).map(at).collect::<Vec<_>>();
        let spoke = |i: u32| {
            let angle = part(i) * std::f32::consts::TAU;
            Vec3A::new(angle.cos(), angle.sin(), 0.0)
        };
        let shell = |radius: f32| Aabb::new(Vec3A::splat(-radius), Vec3A::splat(radius));
        let point = |p| Aabb::new(p, p);
        [
            ("in one place", all(&|_| Aabb::new(Vec3A::ZERO, Vec3A::ONE))),
            ("points in one place", all(&|_| point(Vec3A::ONE))),
            ("points on a line", all(&|i| point(part(i) * Vec3A::X))),
            (
                "points on a line, ever closer",
                all(&|i| point((-0.1 * i as f32).exp2() * Vec3A::X)),
            ),
            ("shells", all(&|i| shell(part(i)))),
            ("shells, ever smaller", all(&|i| shell((-100.0 * part(i)).exp2()))),
            (
                "spokes",
                all(&|i| Aabb::from_points(&[Vec3A::ZERO, spoke(i), spoke(i + 1)])),
            ),
        ]
    }

    #[test]
    fn no_boxes_make_a_deep_tree() {
        for count in [1, 2, 3, 4, 100, 3000, 50_000] {
            for (name, boxes) in boxes(count) {
                for levels in [8, 20] {
                    let tree = Tree::over(boxes.iter().copied(), levels, || name.into()).unwrap();
                    let mut order = tree.order;
                    order.sort_unstable();
                    assert!(order.into_iter().eq(0..count), "{count} {name}: a box is lost");
                }
            }
        }
    }

    #[test]
    fn every_child_lies_within_its_planes() {
        for (name, boxes) in boxes(2000) {
            let mut tree = Tree::over(boxes.iter().copied(), 20, || name.into()).unwrap();
            let leaf = |place: usize| boxes[tree.order[place] as usize];
            let whole = fit(&mut tree.nodes, leaf).unwrap();
            let mut below = vec![Aabb::INVALID; tree.nodes.len()];
            for (index, node) in tree.nodes.iter().enumerate().rev() {
                for child in (0..8).filter(|&c| !node.is_child_empty(c)) {
                    let contents = if node.is_leaf(child) {
                        let (first, count) = node.child_primitives(child);
                        (first..first + count).fold(Aabb::INVALID, |all, place| all.union(&leaf(place as usize)))
                    } else {
                        below[node.child_node_index(child) as usize]
                    };
                    // A plane is a corner of the node and a multiple of a step; the way to it has been rounded once,
                    // and so has their sum.
                    let planes = node.child_aabb(child);
                    let rounding = f32::EPSILON * (node.aabb().min.abs() + node.aabb().diagonal());
                    let min_is_below = (planes.min - rounding).cmple(contents.min);
                    let max_is_above = (planes.max + rounding).cmpge(contents.max);
                    assert!(
                        (min_is_below & max_is_above).all(),
                        "{name}: {contents:?} outside {planes:?}"
                    );
                    below[index] = below[index].union(&contents);
                }
            }
            assert_eq!(whole, below[0], "{name}");
        }
    }

    #[test]
    fn exponents_are_those_of_the_next_power_of_two() {
        for (x, power) in [
            (1.0, 1.0),
            (1.000_001, 2.0),
            (0.75, 1.0),
            (3e-5, 2f32.powi(-15)),
            (0.0, 2f32.powi(-100)),
        ] {
            assert_eq!(u32::from(exponent_above(x)), f32::to_bits(power) >> 23, "{x}");
        }
    }
}

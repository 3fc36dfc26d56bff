// Rays against triangles through two levels of compressed eight-wide trees (Ylitie et al. 2017): one over instances, one
// for each mesh. Reads bvh_nodes, bvh_corners and bvh_instances, which the pass declares, and asks bvh_is_hole of
// bvh_surface.wgsl where a material has holes.
//
// A ray keeps its parameter t in every frame: directions are carried over, not normalised.

// Twins of `resource::bvh_mesh::STACK` and of the bits of `resource::bvh_geometry`.
const BVH_STACK: u32 = 32u;
const BVH_ALL: u32 = 1u;
const BVH_CASTS_SHADOW: u32 = 2u;
const BVH_IN_ENV_MAPS: u32 = 4u;
const BVH_HAS_HOLES: u32 = 8u;
// Above them the number of the instance's surface.
const BVH_SURFACE_SHIFT: u32 = 16u;

const BVH_NODE_WORDS: u32 = 5u;
// No instance, no triangle, not inside an instance.
const BVH_NONE: u32 = 0xffffffffu;
// Further than any two points of a scene are apart.
const BVH_FURTHEST: f32 = 1e30;
// Bits of a group that stand for nodes; below them the mask of the children that are nodes, or bits of leaves.
const BVH_NODE_BITS: u32 = 0xff000000u;
// A tree's root as the only node of a group.
const BVH_ROOT_BIT: u32 = 0x80000000u;
// What rounding may move a plane and a corner by together, relative to their distance. Each passes through five sums and
// products, rounded by 2^-24, and a quotient, which WGSL lets be off by 2.5 units in the last place, five times as much:
// ten roundings for each, 2^-19 for both with some to spare.
const BVH_ROUNDING: f32 = 0x1p-19;
// Smaller components of a direction, relative to the largest, are taken as this small, so that their inverse is finite.
const BVH_SMALLEST: f32 = 0x1p-60;

struct BvhInstance {
    // Columns of the linear map from the unit frame to the mesh's, and of its inverse
    to_mesh: mat3x3f,
    to_unit: mat3x3f,
    // Where the mesh's centre stands in the unit frame
    center: vec3f,
    root: u32,
    first_triangle: u32,
    material: u32,
    mask: u32,
    // Of the leaf with the number of this record: which record it means
    leaf: u32,
}

struct BvhHit {
    // BVH_FURTHEST or the limit asked for if nothing was hit
    distance: f32,
    // Record of the instance, BVH_NONE if nothing was hit
    instance: u32,
    // Triangle in leaf order
    triangle: u32,
    // Weights of its second and third corner
    barycentric: vec2f,
    // Nodes and triangles that the ray was tested against
    nodes_visited: u32,
    triangles_visited: u32,
}

// A ray in one frame, and what the tests take from it.
struct BvhRay {
    origin: vec3f,
    direction: vec3f,
    inverse: vec3f,
    // Exclusive or with it turns the slot of a child into its place in the order of visiting
    octant: u32,
    // Cyclic shift of axes that makes the largest component of the direction the third
    axis: u32,
    // Shear and scale that map the direction to (0, 0, 1)
    shear: vec3f,
}

fn bvh_ray(origin: vec3f, direction: vec3f) -> BvhRay {
    let size = abs(direction);
    let largest = max(size.x, max(size.y, size.z));
    let smallest = vec3f(BVH_SMALLEST * largest);
    let signed_smallest = select(smallest, -smallest, direction < vec3f(0.0));
    let inverse = 1.0 / select(signed_smallest, direction, size >= smallest);
    let positive = vec3u(direction >= vec3f(0.0));
    let octant = positive.x * 4u + positive.y * 2u + positive.z;
    let axis = select(select(2u, 1u, size.y == largest), 0u, size.x == largest);
    let turned = bvh_turn(direction, axis);
    let scale = 1.0 / turned.z;
    return BvhRay(origin, direction, inverse, octant, axis, vec3f(turned.xy * scale, scale));
}

// The axes shifted so that `axis` comes last.
fn bvh_turn(v: vec3f, axis: u32) -> vec3f {
    return select(select(v, v.zxy, axis == 1u), v.yzx, axis == 0u);
}

fn bvh_to_instance(ray: BvhRay, instance: u32) -> BvhRay {
    let to_mesh = bvh_instances[instance].to_mesh;
    return bvh_ray(to_mesh * (ray.origin - bvh_instances[instance].center), to_mesh * ray.direction);
}

fn bvh_bytes(word: u32) -> vec4u {
    return (vec4u(word) >> vec4u(0u, 8u, 16u, 24u)) & vec4u(255u);
}

// A node that the ray meets: the groups of its children that are nodes and that are leaves.
struct BvhGroups {
    nodes: vec2u,
    leaves: vec2u,
}

// Tests the boxes of a node's children. Each slab is widened by what rounding may have moved its planes, the ray's
// origin, or the corners of triangles inside it by (after Ize 2013), so that no box is missed whose triangle would be hit.
fn bvh_visit(index: u32, ray: BvhRay, furthest: f32) -> BvhGroups {
    let at = index * BVH_NODE_WORDS;
    let head = bvh_nodes[at];
    let links = bvh_nodes[at + 1u];
    let exponents = bvh_bytes(head.w);
    let step = bitcast<vec3f>(exponents.xyz << vec3u(23u));
    let offset = bitcast<vec3f>(head.xyz) - ray.origin;
    let reach = abs(offset) + 255.0 * step;
    let rounding = BVH_ROUNDING * max(reach.x, max(reach.y, reach.z)) * abs(ray.inverse);
    let scale = step * ray.inverse;
    let entry = offset * ray.inverse - rounding;
    let exit = offset * ray.inverse + rounding;
    let backward = ray.inverse < vec3f(0.0);
    // Lower planes of eight children, then upper ones, a byte each.
    let planes_x = bvh_nodes[at + 2u];
    let planes_y = bvh_nodes[at + 3u];
    let planes_z = bvh_nodes[at + 4u];
    var hits = 0u;
    for (var half = 0u; half < 2u; half++) {
        let low = vec3u(planes_x[half], planes_y[half], planes_z[half]);
        let high = vec3u(planes_x[2u + half], planes_y[2u + half], planes_z[2u + half]);
        let near = select(low, high, backward);
        let far = select(high, low, backward);
        let near_x = vec4f(bvh_bytes(near.x)) * scale.x + entry.x;
        let near_y = vec4f(bvh_bytes(near.y)) * scale.y + entry.y;
        let near_z = vec4f(bvh_bytes(near.z)) * scale.z + entry.z;
        let far_x = vec4f(bvh_bytes(far.x)) * scale.x + exit.x;
        let far_y = vec4f(bvh_bytes(far.y)) * scale.y + exit.y;
        let far_z = vec4f(bvh_bytes(far.z)) * scale.z + exit.z;
        let enters = max(max(near_x, near_y), max(near_z, vec4f(0.0)));
        let leaves = min(min(far_x, far_y), min(far_z, vec4f(furthest)));
        // Where the lower three bits hold 24 + slot the child is a node; the upper three are its leaves, in unary.
        let kinds = bvh_bytes(links[2u + half]);
        let is_node = (kinds & vec4u(24u)) == vec4u(24u);
        let place = (kinds & vec4u(31u)) ^ select(vec4u(0u), vec4u(ray.octant), is_node);
        let bits = select(vec4u(0u), (kinds >> vec4u(5u)) << place, enters <= leaves);
        hits |= bits.x | bits.y | bits.z | bits.w;
    }
    return BvhGroups(
        vec2u(links.x, (hits & BVH_NODE_BITS) | exponents.w),
        vec2u(links.y, hits & ~BVH_NODE_BITS),
    );
}

// Ray against a triangle (Woop et al. 2013). In the frame where the ray is the third axis, each edge function says on
// which side of the edge the ray passes. The corners are stored in an order that all triangles of the mesh share, so that
// the two triangles at an edge compute the same number, bit for bit, and no ray passes between them; a ray exactly on the
// edge hits both. Returns (distance, weights of the second and third corner); a negative distance is a miss.
fn bvh_triangle(ray: BvhRay, triangle: u32) -> vec3f {
    let to_a = bvh_corners[3u * triangle].xyz - ray.origin;
    let to_b = bvh_corners[3u * triangle + 1u].xyz - ray.origin;
    let to_c = bvh_corners[3u * triangle + 2u].xyz - ray.origin;
    let a = bvh_turn(to_a, ray.axis);
    let b = bvh_turn(to_b, ray.axis);
    let c = bvh_turn(to_c, ray.axis);
    let z = vec3f(a.z, b.z, c.z);
    let x = vec3f(a.x, b.x, c.x) - ray.shear.x * z;
    let y = vec3f(a.y, b.y, c.y) - ray.shear.y * z;
    // Edges bc, ac and ab: one expression for all, so that a compiler cannot round them differently.
    let edges = x.yxx * y.zzy - y.yxx * x.zzy;
    let weights = edges * vec3f(1.0, -1.0, 1.0);
    if (any(weights < vec3f(0.0)) && any(weights > vec3f(0.0))) || all(weights == vec3f(0.0)) {
        return vec3f(-1.0, 0.0, 0.0);
    }
    let shares = weights / (weights.x + weights.y + weights.z);
    let distance = dot(shares, z) * ray.shear.z;
    if distance < 0.0 {
        return vec3f(-1.0, 0.0, 0.0);
    }
    // Where the ray grazes a triangle, or the triangle is thin, rounding is magnified. But no hit comes before the ray is
    // where the triangle begins: then no box that a hit lies in begins behind it, and which hit is the closest depends on
    // no tree and no order.
    let sizes = max(abs(to_a), max(abs(to_b), abs(to_c)));
    let rounding = 0.5 * BVH_ROUNDING * max(sizes.x, max(sizes.y, sizes.z)) * abs(ray.inverse);
    let begins = min(to_a * ray.inverse, min(to_b * ray.inverse, to_c * ray.inverse)) - rounding;
    return vec3f(max(distance, max(begins.x, max(begins.y, begins.z))), shares.yz);
}

// The closest hit of a ray that leaves `origin` along `direction`, nearer than `furthest`, on instances whose mask has a
// bit in common with `mask`; or the first one found, for rays that only ask whether the way is free.
fn bvh_traverse(origin: vec3f, direction: vec3f, furthest: f32, mask: u32, first_will_do: bool) -> BvhHit {
    var hit = BvhHit(furthest, BVH_NONE, BVH_NONE, vec2f(0.0), 0u, 0u);
    let unit_ray = bvh_ray(origin, direction);
    var ray = unit_ray;
    var stack: array<vec2u, BVH_STACK>;
    var depth = 0u;
    // The instance whose mesh is visited, and the depth at which that ends.
    var instance = BVH_NONE;
    var instance_depth = BVH_NONE;
    var nodes = vec2u(0u, BVH_ROOT_BIT);
    loop {
        var leaves = vec2u(0u);
        if nodes.y > ~BVH_NODE_BITS {
            let bit = firstLeadingBit(nodes.y);
            let slot = (bit - 24u) ^ ray.octant;
            let index = nodes.x + countOneBits(nodes.y & ~(0xffffffffu << slot) & 255u);
            nodes.y &= ~(1u << bit);
            if nodes.y > ~BVH_NODE_BITS {
                stack[depth] = nodes;
                depth++;
            }
            let groups = bvh_visit(index, ray, hit.distance);
            hit.nodes_visited++;
            nodes = groups.nodes;
            leaves = groups.leaves;
        } else {
            leaves = nodes;
            nodes = vec2u(0u);
        }
        if instance == BVH_NONE {
            // The next instance that the ray may see. Not in the loop over triangles, where every turn would bear its cost.
            while leaves.y != 0u && instance == BVH_NONE {
                let met = bvh_instances[leaves.x + firstTrailingBit(leaves.y)].leaf;
                leaves.y &= leaves.y - 1u;
                if (bvh_instances[met].mask & mask) != 0u {
                    instance = met;
                }
            }
            if instance != BVH_NONE {
                if nodes.y > ~BVH_NODE_BITS {
                    stack[depth] = nodes;
                    depth++;
                }
                if leaves.y != 0u {
                    stack[depth] = leaves;
                    depth++;
                }
                instance_depth = depth;
                ray = bvh_to_instance(unit_ray, instance);
                nodes = vec2u(bvh_instances[instance].root, BVH_ROOT_BIT);
                leaves.y = 0u;
            }
        }
        while leaves.y != 0u {
            let leaf = leaves.x + firstTrailingBit(leaves.y);
            leaves.y &= leaves.y - 1u;
            let met = bvh_triangle(ray, leaf);
            hit.triangles_visited++;
            if met.x >= 0.0 && met.x < hit.distance && !bvh_is_hole(instance, leaf, met.yz) {
                hit.distance = met.x;
                hit.instance = instance;
                hit.triangle = leaf;
                hit.barycentric = met.yz;
                if first_will_do {
                    return hit;
                }
            }
        }
        if nodes.y <= ~BVH_NODE_BITS {
            if depth == instance_depth {
                instance = BVH_NONE;
                instance_depth = BVH_NONE;
                ray = unit_ray;
            }
            if depth == 0u {
                break;
            }
            depth--;
            nodes = stack[depth];
        }
    }
    return hit;
}

fn bvh_closest(origin: vec3f, direction: vec3f, furthest: f32, mask: u32) -> BvhHit {
    return bvh_traverse(origin, direction, furthest, mask, false);
}

fn bvh_is_free(origin: vec3f, direction: vec3f, furthest: f32, mask: u32) -> bool {
    return bvh_traverse(origin, direction, furthest, mask, true).instance == BVH_NONE;
}

// A hit point's error is a few units in the last place at the size of the largest number that it was computed from. Four of
// them never failed to lead off a surface; this many leave room for what compilers and adapters may round otherwise.
const BVH_OFFSET_ULPS: f32 = 64.0;
// What that size is at least, for points near the frame's origin.
const BVH_OFFSET_REACH: f32 = 0.25;

// A point on a surface, moved off it along a normal. For a hit, `bvh_leave` also knows how it was computed.
fn bvh_offset(p: vec3f, normal: vec3f) -> vec3f {
    return p + (BVH_OFFSET_ULPS * bvh_ulp(abs(p))) * normal;
}

// The distance of neighbouring numbers of this size.
fn bvh_ulp(size: vec3f) -> f32 {
    let reach = max(max(size.x, BVH_OFFSET_REACH), max(size.y, size.z));
    // The power of two at or below `reach`, times 2^-23.
    return bitcast<f32>(bitcast<u32>(reach) & 0x7f800000u) * 0x1p-23;
}

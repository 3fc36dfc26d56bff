// A photon as it is added up.

// Bits of a splat's radius that number its surface, where photons keep to surfaces.
const SPLAT_SURFACE_BITS: u32 = 0xffffu;

// The sign of its radius: it came straight from a flat light, where light on rough metals is sorted.
const SPLAT_STRAIGHT: u32 = 0x80000000u;

struct Splat {
    position: vec3f,
    // Bits of one over the squared radius; where photons keep to surfaces, the last sixteen are the surface's number
    inverse_radius_squared: u32,
    // Flux over squared radius
    strength: vec3f,
    normal: u32,
}

fn splat_inverse(splat: Splat) -> f32 {
    if splat_keeps_to_surfaces {
        return bitcast<f32>(splat.inverse_radius_squared & ~SPLAT_SURFACE_BITS);
    }
    return bitcast<f32>(splat.inverse_radius_squared);
}

// One that reaches no receiver.
fn splat_nothing() -> Splat {
    return Splat(vec3f(0.0), bitcast<u32>(0x1p100f), vec3f(0.0), 0u);
}

// A photon under a kernel of radius h.
fn splat_record(photon: Photon, h: f32) -> Splat {
    var bits = bitcast<u32>(1.0 / (h * h));
    if splat_keeps_to_surfaces {
        // Radii of eight digits, rounded down; flux is spread over what they are then.
        bits = (bits + SPLAT_SURFACE_BITS) & ~SPLAT_SURFACE_BITS;
    }
    let inverse = bitcast<f32>(bits);
    if splat_keeps_to_surfaces {
        bits |= photon_surface(photon.light_and_surface);
    }
    return Splat(photon.position, bits, photon.flux * inverse, photon.normal);
}

// How surfaces scatter: sampling a direction, and evaluating one with its density. Directions point away from the
// surface; `outgoing` is the one towards the eye. Rough lobes are GGX with Smith shadowing of both directions apart
// (Walter et al. 2007), their normals sampled as they are seen (Heitz 2018); or Phong, normalised so that none creates light
// (Lafortune and Willems 1994).

const SCATTER_DIFFUSE: u32 = 0u;
const SCATTER_MIRROR: u32 = 1u;
const SCATTER_METAL: u32 = 2u;
const SCATTER_GLASS: u32 = 3u;
const SCATTER_ROUGH_GLASS: u32 = 4u;
const SCATTER_PHONG: u32 = 5u;

// Twins of the conventions of `scene::Material`.
const SCATTER_IS_METAL: f32 = 0.5;
const SCATTER_IS_TRANSMISSIVE: f32 = 0.5;
// Narrower lobes are as narrow as this.
const SCATTER_LEAST_ALPHA: f32 = 0.001;
// Glass of an index nearer to 1 than this is taken as smooth: from directions that differ by rounding alone no facet can be
// told.
const SCATTER_LEAST_BENDING: f32 = 0x1p-10;
const SCATTER_PI: f32 = 3.14159265;

// A surface as a ray finds it.
struct Scatterer {
    kind: u32,
    // The third axis is the shading normal, on the side that the ray came from
    frame: mat3x3f,
    // Reflectance, or the tint of what passes through
    color: vec3f,
    // Of GGX; the exponent of a Phong lobe
    alpha: f32,
    // Whether its facets scatter light more than once
    is_multiple: bool,
    // Index of refraction of the far side over that of the near side
    eta: f32,
}

struct Scattering {
    direction: vec3f,
    // BSDF times cosine over density
    weight: vec3f,
    // Per solid angle; 0 where the direction is the only one
    pdf: f32,
    // Square of the index of refraction over there over that over here
    squeeze: f32,
}

// Of a material by the conventions of glTF 2.0, roughness as of `lobe_metal`. `normal` is on the side that the ray came from.
fn scatter_by(
    normal: vec3f, is_front: bool, color: vec3f, metallic: f32, coded_roughness: f32, transmission: f32, index: f32,
) -> Scatterer {
    let is_phong = coded_roughness < 0.0;
    let is_multiple = coded_roughness >= LOBE_MULTIPLE;
    let roughness = select(coded_roughness, coded_roughness - LOBE_MULTIPLE, is_multiple);
    let is_smooth = roughness < LOBE_SMOOTH && !is_phong;
    var kind = SCATTER_DIFFUSE;
    if transmission > SCATTER_IS_TRANSMISSIVE {
        // Facets that do not bend light leave it a single direction.
        let is_single = is_smooth || index - 1.0 < SCATTER_LEAST_BENDING;
        kind = select(SCATTER_ROUGH_GLASS, SCATTER_GLASS, is_single);
    } else if metallic > SCATTER_IS_METAL {
        kind = select(select(SCATTER_METAL, SCATTER_MIRROR, is_smooth), SCATTER_PHONG, is_phong);
    }
    let alpha = select(max(roughness * roughness, SCATTER_LEAST_ALPHA), -roughness, is_phong);
    return Scatterer(kind, sampling_frame(normal), color, alpha, is_multiple, select(1.0 / index, index, is_front));
}

// As a lobe says.
fn scatter_by_lobe(lobe: u32, normal: vec3f, is_front: bool, color: vec3f) -> Scatterer {
    let kind = lobe_kind(lobe);
    let metallic = select(0.0, 1.0, kind == LOBE_METAL || kind == LOBE_PHONG);
    let transmission = select(0.0, 1.0, kind == LOBE_GLASS);
    let index = select(1.0, lobe_index_of_refraction(lobe), kind == LOBE_GLASS);
    return scatter_by(normal, is_front, color, metallic, lobe_roughness(lobe), transmission, index);
}

// Whether it scatters into single directions only, which no light can be sampled for.
fn scatter_is_smooth(s: Scatterer) -> bool {
    return s.kind == SCATTER_MIRROR || s.kind == SCATTER_GLASS;
}

fn scatter_sample(s: Scatterer, outgoing: vec3f, random: vec4f) -> Scattering {
    let o = outgoing * s.frame;
    var local: Scattering;
    switch s.kind {
        case SCATTER_MIRROR: { local = Scattering(vec3f(-o.xy, o.z), s.color, 0.0, 1.0); }
        case SCATTER_METAL: { local = scatter_sample_metal(s, o, random); }
        case SCATTER_PHONG: { local = scatter_sample_phong(s, o, random); }
        case SCATTER_GLASS: { local = scatter_sample_glass(s, o, vec3f(0.0, 0.0, 1.0), random.z); }
        case SCATTER_ROUGH_GLASS: { local = scatter_sample_rough_glass(s, o, random); }
        default: {
            let i = sampling_cosine(random.xy);
            local = Scattering(i, s.color, i.z / SCATTER_PI, 1.0);
        }
    }
    local.direction = normalize(s.frame * local.direction);
    return local;
}

// BSDF times cosine of the incoming direction, and the density with which `scatter_sample` finds it.
fn scatter_evaluate(s: Scatterer, outgoing: vec3f, incoming: vec3f) -> vec4f {
    let o = outgoing * s.frame;
    let i = incoming * s.frame;
    switch s.kind {
        case SCATTER_DIFFUSE: {
            let share = max(0.0, i.z) / SCATTER_PI;
            return vec4f(share * s.color, share);
        }
        case SCATTER_METAL: {
            if i.z <= 0.0 || o.z <= 0.0 {
                return vec4f(0.0);
            }
            let h = normalize(o + i);
            let seen = ggx_seen_density(o, h, s.alpha) / (4.0 * dot(o, h));
            return vec4f(scatter_metal_color(s, o) * seen * ggx_lit_share(i, s.alpha), seen);
        }
        case SCATTER_PHONG: {
            if i.z <= 0.0 || o.z <= 0.0 {
                return vec4f(0.0);
            }
            let share = pow(max(0.0, dot(i, vec3f(-o.xy, o.z))), s.alpha) / (2.0 * SCATTER_PI);
            return vec4f(s.color * (share * (s.alpha + 2.0) * i.z), share * (s.alpha + 1.0));
        }
        case SCATTER_ROUGH_GLASS: { return scatter_evaluate_rough_glass(s, o, i); }
        default: { return vec4f(0.0); }
    }
}

// With normals sampled as they are seen, what is left of the BSDF is the share of them that light reaches.
fn scatter_sample_metal(s: Scatterer, o: vec3f, random: vec4f) -> Scattering {
    let h = ggx_sample_seen(o, s.alpha, random.xy);
    let i = reflect(-o, h);
    if i.z <= 0.0 || o.z <= 0.0 {
        return Scattering(vec3f(0.0, 0.0, 1.0), vec3f(0.0), 1.0, 1.0);
    }
    let pdf = ggx_seen_density(o, h, s.alpha) / (4.0 * max(dot(o, h), 1e-20));
    return Scattering(i, scatter_metal_color(s, o) * ggx_lit_share(i, s.alpha), pdf, 1.0);
}

// Colour of a rough metal: with what facets reflect to each other, as often as it takes, sent out as the rest is. A share E of
// light leaves after one reflection, and of what each facet reflects on to others again E: color E / (1 - color (1 - E))
// in all, of which a factor color E is the lobe's (Turquin 2019 with the series of Kulla and Conty 2017).
fn scatter_metal_color(s: Scatterer, o: vec3f) -> vec3f {
    if !s.is_multiple {
        return s.color;
    }
    return s.color / (1.0 - s.color * ggx_loss(o.z, s.alpha));
}

// As dense as a power of the cosine with the mirrored direction.
fn scatter_sample_phong(s: Scatterer, o: vec3f, random: vec4f) -> Scattering {
    let logarithm = log(max(random.x, 0x1p-32)) / (s.alpha + 1.0);
    let cosine = exp(logarithm);
    // 1 - cos^2, by its series where digits would cancel.
    let sine_squared = select(1.0 - cosine * cosine, -2.0 * logarithm * (1.0 + logarithm), logarithm > -0x1p-10);
    let phi = 2.0 * SCATTER_PI * random.y;
    let around = sqrt(sine_squared) * vec2f(cos(phi), sin(phi));
    let i = sampling_frame(vec3f(-o.xy, o.z)) * vec3f(around, cosine);
    if i.z <= 0.0 || o.z <= 0.0 {
        return Scattering(vec3f(0.0, 0.0, 1.0), vec3f(0.0), 1.0, 1.0);
    }
    let pdf = (s.alpha + 1.0) / (2.0 * SCATTER_PI) * pow(cosine, s.alpha);
    return Scattering(i, s.color * ((s.alpha + 2.0) / (s.alpha + 1.0) * i.z), pdf, 1.0);
}

// Reflects or refracts about a normal by chance. Radiance that enters a denser medium is squeezed into a narrower cone,
// by the square of the ratio of indices.
fn scatter_sample_glass(s: Scatterer, o: vec3f, h: vec3f, chance: f32) -> Scattering {
    let cosine = dot(o, h);
    let fresnel = fresnel_dielectric(cosine, s.eta);
    if chance < fresnel.x {
        return Scattering(reflect(-o, h), vec3f(1.0), 0.0, 1.0);
    }
    let i = (cosine / s.eta - fresnel.y) * h - o / s.eta;
    return Scattering(i, s.color / (s.eta * s.eta), 0.0, s.eta * s.eta);
}

fn scatter_sample_rough_glass(s: Scatterer, o: vec3f, random: vec4f) -> Scattering {
    let h = ggx_sample_seen(o, s.alpha, random.xy);
    var sample = scatter_sample_glass(s, o, h, random.z);
    let transmits = sample.direction.z < 0.0;
    // A direction on the wrong side of the surface is one that the neighbouring facets would block.
    let is_blocked = transmits != (dot(sample.direction, h) < 0.0);
    if is_blocked || o.z <= 0.0 || sample.direction.z == 0.0 {
        return Scattering(vec3f(0.0, 0.0, 1.0), vec3f(0.0), 1.0, 1.0);
    }
    sample.weight *= ggx_lit_share(sample.direction, s.alpha);
    sample.pdf = scatter_evaluate_rough_glass(s, o, sample.direction).w;
    return sample;
}

// Walter et al. 2007, equations 20 and 21, for radiance.
fn scatter_evaluate_rough_glass(s: Scatterer, o: vec3f, i: vec3f) -> vec4f {
    if o.z <= 0.0 || i.z == 0.0 {
        return vec4f(0.0);
    }
    let is_reflected = i.z > 0.0;
    // The facet's normal, on the side of `o`.
    var h = normalize(select(-(o + s.eta * i), o + i, is_reflected));
    h = select(-h, h, h.z > 0.0);
    let cosine_o = dot(o, h);
    let cosine_i = dot(i, h);
    if cosine_o <= 0.0 || (cosine_i > 0.0) != is_reflected {
        return vec4f(0.0);
    }
    let fresnel = fresnel_dielectric(cosine_o, s.eta).x;
    let seen = ggx_seen_density(o, h, s.alpha);
    let lit = ggx_lit_share(i, s.alpha);
    if is_reflected {
        let pdf = fresnel * seen / (4.0 * cosine_o);
        return vec4f(vec3f(pdf * lit), pdf);
    }
    let bent = cosine_o + s.eta * cosine_i;
    let pdf = (1.0 - fresnel) * seen * s.eta * s.eta * abs(cosine_i) / max(bent * bent, 1e-20);
    return vec4f(s.color * (pdf * lit / (s.eta * s.eta)), pdf);
}

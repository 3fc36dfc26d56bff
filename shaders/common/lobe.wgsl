// How a surface scatters light, in 14 bits beside its colour: what surface texels, G-buffers and photons keep of a material.
//   bits 0-1  LOBE_DIFFUSE, LOBE_METAL, LOBE_GLASS or LOBE_PHONG
//   metal     bits 2-12 perceptual roughness, in 2047ths; bit 13: its facets scatter light more than once
//   Phong     bits 2-13 log2(exponent + 1), in 256ths; its roughness is minus the exponent
//   glass     bits 2-6 perceptual roughness, in 31sts; bits 7-13 index of refraction - 1, in 64ths
// A diffuse surface is 0.

const LOBE_DIFFUSE: u32 = 0u;
const LOBE_METAL: u32 = 1u;
const LOBE_GLASS: u32 = 2u;
const LOBE_PHONG: u32 = 3u;
const LOBE_KIND: u32 = 3u;
const LOBE_BITS: u32 = 0x3fffu;
// Twin of the conventions of `scene::Material`: of less roughness than this a surface is smooth.
const LOBE_SMOOTH: f32 = 0.03;

// What roughness is more by where facets scatter light more than once. Twin of `scene::material::LOBE_MULTIPLE`.
const LOBE_MULTIPLE: f32 = 2.0;
const LOBE_MULTIPLE_BIT: u32 = 1u << 13u;

// Of GGX, with LOBE_MULTIPLE or without, or of a Phong lobe where roughness is negative.
fn lobe_metal(roughness: f32) -> u32 {
    if roughness < 0.0 {
        return LOBE_PHONG | (u32(round(min(256.0 * log2(1.0 - roughness), 4095.0))) << 2u);
    }
    let is_multiple = roughness >= LOBE_MULTIPLE;
    let own = select(roughness, roughness - LOBE_MULTIPLE, is_multiple);
    // A smooth surface has no facets.
    let bit = select(0u, LOBE_MULTIPLE_BIT, is_multiple && own >= LOBE_SMOOTH);
    return LOBE_METAL | (u32(round(saturate(own) * 2047.0)) << 2u) | bit;
}

// Index of refraction from 1 to 2.98.
fn lobe_glass(roughness: f32, index_of_refraction: f32) -> u32 {
    let index = u32(round(clamp((index_of_refraction - 1.0) * 64.0, 0.0, 127.0)));
    return LOBE_GLASS | (u32(round(saturate(roughness) * 31.0)) << 2u) | (index << 7u);
}

// Of a material by the conventions of glTF 2.0; roughness as of `lobe_metal`.
fn lobe_of(metallic: f32, roughness: f32, transmission: f32, index_of_refraction: f32) -> u32 {
    if transmission > 0.5 {
        return lobe_glass(roughness, index_of_refraction);
    }
    return select(LOBE_DIFFUSE, lobe_metal(roughness), metallic > 0.5);
}

// Roughness times that of a texture, which scales no Phong exponent.
fn lobe_textured(roughness: f32, texel: f32) -> f32 {
    if roughness >= LOBE_MULTIPLE {
        return LOBE_MULTIPLE + (roughness - LOBE_MULTIPLE) * texel;
    }
    return select(roughness * texel, roughness, roughness < 0.0);
}

fn lobe_kind(lobe: u32) -> u32 {
    return lobe & LOBE_KIND;
}

fn lobe_is_specular(lobe: u32) -> bool {
    return (lobe & LOBE_KIND) != LOBE_DIFFUSE;
}

// Whether it reflects all light, and into more directions than one.
fn lobe_is_glossy(lobe: u32) -> bool {
    let kind = lobe_kind(lobe);
    return kind == LOBE_PHONG || (kind == LOBE_METAL && lobe_roughness(lobe) >= LOBE_SMOOTH);
}

fn lobe_roughness(lobe: u32) -> f32 {
    if lobe_kind(lobe) == LOBE_METAL {
        return f32((lobe >> 2u) & 2047u) / 2047.0 + select(0.0, LOBE_MULTIPLE, (lobe & LOBE_MULTIPLE_BIT) != 0u);
    }
    if lobe_kind(lobe) == LOBE_PHONG {
        return 1.0 - exp2(f32((lobe >> 2u) & 4095u) / 256.0);
    }
    return f32((lobe >> 2u) & 31u) / 31.0;
}

fn lobe_index_of_refraction(lobe: u32) -> f32 {
    return 1.0 + f32((lobe >> 7u) & 127u) / 64.0;
}

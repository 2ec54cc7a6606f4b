//! How much light surfaces send back, at 905 nm.
//!
//! The numbers are round values for clean, dry surfaces near 905 nm, in the middle of what
//! spectral libraries list for the class (\[ASTER\], \[USGS7\]); the lobes and retroreflective
//! gains are engineering estimates. They set how bright things are relative to each other, not a
//! calibrated reflectance. Each can be overridden in a scene file.

/// A surface as a monostatic lidar sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name, as scene files and mesh files use it.
    pub name: String,
    /// Diffuse (Lambertian) reflectance, 0…1.
    pub diffuse: f64,
    /// Height of the specular lobe at normal incidence, relative to white Lambertian.
    pub specular: f64,
    /// Exponent of the lobe; larger is narrower.
    pub gloss: f64,
    /// Retroreflective gain over a white Lambertian surface.
    pub retro: f64,
    /// One-way transmission, 0…1; 0 is opaque.
    pub transmission: f64,
}

impl Material {
    /// A matt, opaque surface.
    pub fn matt(name: &str, diffuse: f64) -> Self {
        let name = name.to_owned();
        Self { name, diffuse, specular: 0.0, gloss: 1.0, retro: 0.0, transmission: 0.0 }
    }

    /// Effective reflectance of backscatter at an incidence angle of this `cosine`; 1 is a white
    /// Lambertian surface seen square on.
    ///
    /// `ρ_eff = (ρ_d + ρ_r)·cos i + ρ_s·cosᵍ i`, with diffuse `ρ_d`, retroreflective gain `ρ_r`,
    /// lobe height `ρ_s` and gloss `g`. The lobe is Phong's \[Pho75\]: seen along the axis of
    /// illumination, the mirror direction is `2i` away, and `cosᵍ i` is the form with the half
    /// vector \[Bli77\].
    pub fn backscatter(&self, cosine: f64) -> f64 {
        let cosine = cosine.abs().min(1.0);
        let matt = (self.diffuse + self.retro) * cosine;
        // Far off the lobe its power is not worth working out: added, it would change nothing.
        let far_off = self.gloss * (1.0 - cosine) > FAR_OFF;
        match self.specular <= 0.0 || far_off && self.specular * FAINT < matt {
            true => matt,
            false => matt + self.specular * libm::pow(cosine, self.gloss),
        }
    }

    /// Effective reflectance towards a place that is not the source of the light: `cosine` of the
    /// angle between the normal and that place, `half_cosine` of that between the normal and the
    /// middle of both directions.
    ///
    /// `ρ_eff = ρ_d·cos o + ρ_s·cosᵍ h`: the Lambertian part falls with the angle it is seen at, and
    /// the lobe is that of [`Material::backscatter`] \[Bli77\]. What a retroreflector sends back
    /// goes to the source alone.
    pub fn scatter(&self, cosine: f64, half_cosine: f64) -> f64 {
        let [cosine, half_cosine] = [cosine, half_cosine].map(|cosine| cosine.abs().min(1.0));
        let lobe = match self.specular > 0.0 {
            true => self.specular * libm::pow(half_cosine, self.gloss),
            false => 0.0,
        };
        self.diffuse * cosine + lobe
    }

    /// Height of the lobe of a surface that mirrors the fraction `mirrored` of the light into a
    /// lobe of exponent `gloss`: `ρ_s = F·(g+2)/8`, that is `π·F·D/4` for the normal distribution
    /// `D = (g+2)/2π · cosᵍ` that keeps the energy \[WMLT07\].
    pub fn lobe_height(mirrored: f64, gloss: f64) -> f64 {
        mirrored * (gloss + 2.0) / 8.0
    }
}

/// As cos i ≤ exp(cos i − 1), at g·(1 − cos i) beyond this cosᵍ i is less than e⁻⁶⁰ …
const FAR_OFF: f64 = 60.0;

/// … and with e⁻⁶⁰ = 8.8·10⁻²⁷ less than 2⁻⁵⁴ of what this times as much is less than.
const FAINT: f64 = 1e-9;

/// A row of the library: name, diffuse, mirrored fraction, gloss, retroreflective gain,
/// transmission.
type Row = (&'static str, f64, f64, f64, f64, f64);

/// Name of the material that surfaces get of which nothing is known.
pub const UNNAMED: &str = "unnamed";

const LIBRARY: &[Row] = &[
    // References.
    ("white", 1.0, 0.0, 1.0, 0.0, 0.0),
    ("grey10", 0.1, 0.0, 1.0, 0.0, 0.0),
    ("grey50", 0.5, 0.0, 1.0, 0.0, 0.0),
    (UNNAMED, 0.3, 0.0, 1.0, 0.0, 0.0),
    // Ground and buildings.
    ("asphalt", 0.2, 0.0, 1.0, 0.0, 0.0),
    ("concrete", 0.4, 0.0, 1.0, 0.0, 0.0),
    ("brick", 0.45, 0.0, 1.0, 0.0, 0.0),
    ("plaster", 0.7, 0.0, 1.0, 0.0, 0.0),
    ("marble", 0.6, 0.03, 20.0, 0.0, 0.0),
    ("wood", 0.55, 0.0, 1.0, 0.0, 0.0),
    ("soil", 0.3, 0.0, 1.0, 0.0, 0.0),
    ("snow", 0.85, 0.0, 1.0, 0.0, 0.0),
    // Living things: the plateau of leaves beyond the red edge; skin and cloth are bright too.
    ("grass", 0.5, 0.0, 1.0, 0.0, 0.0),
    ("vegetation", 0.5, 0.0, 1.0, 0.0, 0.0),
    ("skin", 0.5, 0.0, 1.0, 0.0, 0.0),
    ("fabric", 0.4, 0.0, 1.0, 0.0, 0.0),
    // Vehicles. Paint is a pigment under clear coat of index 1.5, which mirrors 4 %.
    ("paint-white", 0.8, 0.04, 200.0, 0.0, 0.0),
    ("paint-silver", 0.45, 0.08, 60.0, 0.0, 0.0),
    ("paint-red", 0.55, 0.04, 200.0, 0.0, 0.0),
    ("paint-blue", 0.25, 0.04, 200.0, 0.0, 0.0),
    ("paint-black", 0.05, 0.04, 200.0, 0.0, 0.0),
    ("rubber", 0.05, 0.0, 1.0, 0.0, 0.0),
    ("plastic", 0.3, 0.04, 20.0, 0.0, 0.0),
    ("plastic-black", 0.08, 0.04, 10.0, 0.0, 0.0),
    ("metal", 0.35, 0.3, 30.0, 0.0, 0.0),
    ("chrome", 0.05, 0.6, 400.0, 0.0, 0.0),
    // Two faces mirror 8 %, and dust scatters a little.
    ("glass", 0.02, 0.08, 400.0, 0.0, 0.8),
    ("number-plate", 0.5, 0.0, 1.0, 20.0, 0.0),
    ("road-sign", 0.4, 0.0, 1.0, 50.0, 0.0),
    ("headlamp", 0.1, 0.08, 200.0, 3.0, 0.0),
    ("tail-lamp", 0.2, 0.04, 200.0, 10.0, 0.0),
];

fn material(&(name, diffuse, mirrored, gloss, retro, transmission): &Row) -> Material {
    let specular = Material::lobe_height(mirrored, gloss);
    Material { name: name.to_owned(), diffuse, specular, gloss, retro, transmission }
}

/// All materials of the library, in its order.
pub fn library() -> impl Iterator<Item = Material> {
    LIBRARY.iter().map(material)
}

/// The material of the library called `name`; case, spaces and underscores do not matter.
pub fn named(name: &str) -> Option<Material> {
    let wanted = plain(name);
    LIBRARY.iter().find(|row| row.0 == wanted).map(material)
}

/// A name as the library writes it: lower case, words joined by hyphens.
pub fn plain(name: &str) -> String {
    name.trim().to_lowercase().replace([' ', '_'], "-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_sends_everything_back_by_the_cosine() {
        let white = named("white").unwrap();
        assert_eq!(white.backscatter(1.0), 1.0);
        assert_eq!(white.backscatter(0.25), 0.25);
        assert_eq!(white.backscatter(0.0), 0.0);
    }

    #[test]
    fn seen_from_the_source_it_scatters_what_it_sends_back_but_for_retroreflectors() {
        for material in library() {
            for cosine in [0.0, 0.3, 1.0] {
                let back = material.backscatter(cosine) - material.retro * cosine;
                approx::assert_relative_eq!(
                    material.scatter(cosine, cosine),
                    back,
                    epsilon = 1e-12
                );
            }
        }
        // A mirror 30° off both ways is bright; seen from 45° it is not.
        let chrome = named("chrome").unwrap();
        assert!(chrome.scatter(0.87, 1.0) > 100.0 * chrome.scatter(0.71, 0.97));
    }

    #[test]
    fn a_lobe_is_bright_only_square_on() {
        let paint = named("paint-black").unwrap();
        assert!(paint.backscatter(1.0) > 1.0);
        // 20° off, cos²⁰⁰ has left nothing but the pigment.
        let off = 20f64.to_radians().cos();
        approx::assert_relative_eq!(paint.backscatter(off), 0.05 * off, max_relative = 1e-3);
    }

    #[test]
    fn what_is_left_out_far_off_the_lobe_changes_no_bit() {
        let mut left_out = 0;
        for material in library().filter(|material| material.specular > 0.0) {
            let Material { diffuse, specular, gloss, retro, .. } = material;
            for i in 0..=1000 {
                let cosine = f64::from(i) / 1000.0;
                let whole = (diffuse + retro) * cosine + specular * libm::pow(cosine, gloss);
                assert_eq!(material.backscatter(cosine).to_bits(), whole.to_bits());
                left_out += usize::from(gloss * (1.0 - cosine) > FAR_OFF);
            }
        }
        assert!(left_out > 1000);
    }

    #[test]
    fn no_material_makes_light() {
        for material in library() {
            // A lobe of height ρ_s carries about 8·ρ_s/(g+2) of the light.
            let mirrored = 8.0 * material.specular / (material.gloss + 2.0);
            let sum = material.diffuse + mirrored + material.transmission;
            assert!(sum <= 1.0 + 1e-12, "{} sends out {sum}", material.name);
        }
    }

    #[test]
    fn names_are_forgiving_and_typing_errors_are_seen_through() {
        assert_eq!(named("Number Plate").unwrap().name, "number-plate");
        assert_eq!(named("asphlat"), None);
    }
}

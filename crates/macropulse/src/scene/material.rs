//! How much light surfaces send back, by wavelength.
//!
//! A material of the library has its diffuse reflectance at some wavelengths, medians of open spectral
//! libraries (\[ASTER\], \[SB\], docs/formats.md#materials says which). Between them it is linear, beyond
//! them constant. Values that no library tells, lobes and retroreflective gains among them, are round
//! engineering estimates for clean, dry surfaces, the same at every wavelength. Each can be overridden in a
//! scene file, by one number for all wavelengths.

/// A material: what surfaces are made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name, as scene files and mesh files use it.
    pub name: String,
    /// Diffuse (Lambertian) reflectance.
    pub diffuse: Diffuse,
    /// Height of the specular lobe at normal incidence, relative to white Lambertian.
    pub specular: f64,
    /// Exponent of the lobe; larger is narrower.
    pub gloss: f64,
    /// Retroreflective gain over a white Lambertian surface.
    pub retro: f64,
    /// One-way transmission, 0…1; 0 is opaque.
    pub transmission: f64,
}

/// Diffuse reflectance, 0…1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Diffuse {
    /// The same at every wavelength.
    Even(f64),
    /// At these wavelengths, nm, ascending.
    At(&'static [(f64, f64)]),
}

impl Diffuse {
    /// At `wavelength` metres: linear between those known, as at the nearest beyond them.
    pub fn at(&self, wavelength: f64) -> f64 {
        let known = match *self {
            Self::Even(diffuse) => return diffuse,
            Self::At(known) => known,
        };
        let nm = wavelength * 1e9;
        let behind = known.partition_point(|(at, _)| *at < nm);
        let before = behind.checked_sub(1).and_then(|before| known.get(before));
        match (before, known.get(behind)) {
            (Some(&(low, from)), Some(&(high, to))) => {
                from + (to - from) * (nm - low) / (high - low)
            }
            (Some(&(_, end)), None) | (None, Some(&(_, end))) => end,
            (None, None) => 0.0,
        }
    }
}

impl Material {
    /// A matt, opaque surface, the same at every wavelength.
    pub fn matt(name: &str, diffuse: f64) -> Self {
        let (name, diffuse) = (name.to_owned(), Diffuse::Even(diffuse));
        Self { name, diffuse, specular: 0.0, gloss: 1.0, retro: 0.0, transmission: 0.0 }
    }

    /// As light of `wavelength` metres sees it.
    pub fn at(&self, wavelength: f64) -> Finish {
        let &Self { specular, gloss, retro, .. } = self;
        Finish { diffuse: self.diffuse.at(wavelength), specular, gloss, retro }
    }

    /// Height of the lobe of a surface that mirrors the fraction `mirrored` of the light into a
    /// lobe of exponent `gloss`: `ρ_s = F·(g+2)/8`, that is `π·F·D/4` for the normal distribution
    /// `D = (g+2)/2π · cosᵍ` that keeps the energy \[WMLT07\].
    pub fn lobe_height(mirrored: f64, gloss: f64) -> f64 {
        mirrored * (gloss + 2.0) / 8.0
    }
}

/// A surface of some material as a monostatic lidar of one wavelength sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finish {
    /// Diffuse (Lambertian) reflectance, 0…1.
    pub diffuse: f64,
    /// As [`Material::specular`].
    pub specular: f64,
    /// As [`Material::gloss`].
    pub gloss: f64,
    /// As [`Material::retro`].
    pub retro: f64,
}

impl Finish {
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
    /// `ρ_eff = ρ_d·cos o + ρ_s·cosᵍ h`: the Lambertian part falls with the angle it is seen at, and the lobe
    /// is that of [`Finish::backscatter`] \[Bli77\]. Light that a retroreflector sends back goes to the
    /// source alone.
    pub fn scatter(&self, cosine: f64, half_cosine: f64) -> f64 {
        let [cosine, half_cosine] = [cosine, half_cosine].map(|cosine| cosine.abs().min(1.0));
        let lobe = match self.specular > 0.0 {
            true => self.specular * libm::pow(half_cosine, self.gloss),
            false => 0.0,
        };
        self.diffuse * cosine + lobe
    }
}

/// As cos i ≤ exp(cos i − 1), at g·(1 − cos i) beyond this cosᵍ i is less than e⁻⁶⁰ …
const FAR_OFF: f64 = 60.0;

/// … and with e⁻⁶⁰ = 8.8·10⁻²⁷ less than 2⁻⁵⁴ of what this times as much is less than.
const FAINT: f64 = 1e-9;

/// A row of the library: name, diffuse, mirrored fraction, gloss, retroreflective gain,
/// transmission.
type Row = (&'static str, Diffuse, f64, f64, f64, f64);

/// Name of the material of surfaces about which nothing is known.
pub const UNNAMED: &str = "unnamed";

/// Retroreflective gain over white of sheeting with a coefficient of retroreflection of `r_a`
/// cd/lx/m²: white Lambertian has 1/π of these.
const fn sheeting(r_a: f64) -> f64 {
    std::f64::consts::PI * r_a
}

const LIBRARY: &[Row] = &[
    // References.
    ("white", Diffuse::Even(1.0), 0.0, 1.0, 0.0, 0.0),
    ("grey10", Diffuse::Even(0.1), 0.0, 1.0, 0.0, 0.0),
    ("grey50", Diffuse::Even(0.5), 0.0, 1.0, 0.0, 0.0),
    (UNNAMED, Diffuse::Even(0.3), 0.0, 1.0, 0.0, 0.0),
    // Ground and buildings.
    ("asphalt", Diffuse::At(ROAD), 0.0, 1.0, 0.0, 0.0),
    ("concrete", Diffuse::At(SIDEWALK), 0.0, 1.0, 0.0, 0.0),
    ("brick", Diffuse::Even(0.45), 0.0, 1.0, 0.0, 0.0),
    ("plaster", Diffuse::Even(0.7), 0.0, 1.0, 0.0, 0.0),
    ("marble", Diffuse::Even(0.6), 0.03, 20.0, 0.0, 0.0),
    ("wood", Diffuse::At(PINE), 0.0, 1.0, 0.0, 0.0),
    ("soil", Diffuse::Even(0.3), 0.0, 1.0, 0.0, 0.0),
    ("snow", Diffuse::At(SNOW), 0.0, 1.0, 0.0, 0.0),
    // Living things: the plateau of leaves beyond the red edge, and the water in them.
    ("grass", Diffuse::At(GRASS), 0.0, 1.0, 0.0, 0.0),
    ("grass-dry", Diffuse::At(DRY_GRASS), 0.0, 1.0, 0.0, 0.0),
    ("vegetation", Diffuse::At(LEAVES), 0.0, 1.0, 0.0, 0.0),
    ("conifer", Diffuse::At(NEEDLES), 0.0, 1.0, 0.0, 0.0),
    ("skin", Diffuse::At(SKIN), 0.0, 1.0, 0.0, 0.0),
    ("fabric", Diffuse::Even(0.4), 0.0, 1.0, 0.0, 0.0),
    // Vehicles. Paint is a pigment under clear coat of index 1.5, which mirrors 4 %.
    ("paint-white", Diffuse::Even(0.8), 0.04, 200.0, 0.0, 0.0),
    ("paint-silver", Diffuse::Even(0.45), 0.08, 60.0, 0.0, 0.0),
    ("paint-red", Diffuse::Even(0.55), 0.04, 200.0, 0.0, 0.0),
    ("paint-blue", Diffuse::Even(0.25), 0.04, 200.0, 0.0, 0.0),
    ("paint-black", Diffuse::Even(0.05), 0.04, 200.0, 0.0, 0.0),
    ("rubber", Diffuse::Even(0.05), 0.0, 1.0, 0.0, 0.0),
    ("plastic", Diffuse::Even(0.3), 0.04, 20.0, 0.0, 0.0),
    ("plastic-black", Diffuse::Even(0.08), 0.04, 10.0, 0.0, 0.0),
    ("metal", Diffuse::Even(0.35), 0.3, 30.0, 0.0, 0.0),
    ("aluminium", Diffuse::At(ALUMINIUM), 0.0, 1.0, 0.0, 0.0),
    ("chrome", Diffuse::Even(0.05), 0.6, 400.0, 0.0, 0.0),
    // Two faces mirror 8 %, and dust scatters a little.
    ("glass", Diffuse::Even(0.02), 0.08, 400.0, 0.0, 0.8),
    // Sheeting of type I and of type III, new, seen 0.2° beside the light.
    ("number-plate", Diffuse::Even(0.5), 0.0, 1.0, sheeting(70.0), 0.0),
    ("road-sign", Diffuse::Even(0.4), 0.0, 1.0, sheeting(250.0), 0.0),
    ("headlamp", Diffuse::Even(0.1), 0.08, 200.0, 3.0, 0.0),
    ("tail-lamp", Diffuse::Even(0.2), 0.04, 200.0, 10.0, 0.0),
];

/// Median of 170 roads \[SB\].
const ROAD: &[(f64, f64)] =
    &[(850.0, 0.108), (905.0, 0.109), (940.0, 0.110), (1064.0, 0.114), (1550.0, 0.139)];

/// Median of 60 sidewalks of concrete \[SB\].
const SIDEWALK: &[(f64, f64)] =
    &[(850.0, 0.307), (905.0, 0.314), (940.0, 0.316), (1064.0, 0.346), (1550.0, 0.389)];

/// Planed pine \[ASTER\].
const PINE: &[(f64, f64)] =
    &[(850.0, 0.917), (905.0, 0.918), (940.0, 0.915), (1064.0, 0.905), (1550.0, 0.565)];

/// Grains with 20 m² of surface to a kilogram, as of snow some days old, by the absorption of ice
/// \[KZ04\]; at 1550 nm a few per cent.
const SNOW: &[(f64, f64)] = &[(905.0, 0.78), (1064.0, 0.62), (1550.0, 0.05)];

/// Green grass \[ASTER\].
const GRASS: &[(f64, f64)] =
    &[(850.0, 0.497), (905.0, 0.509), (940.0, 0.507), (1064.0, 0.525), (1550.0, 0.243)];

/// Dry grass \[ASTER\].
const DRY_GRASS: &[(f64, f64)] =
    &[(850.0, 0.566), (905.0, 0.598), (940.0, 0.618), (1064.0, 0.650), (1550.0, 0.569)];

/// Deciduous trees \[ASTER\].
const LEAVES: &[(f64, f64)] =
    &[(850.0, 0.550), (905.0, 0.554), (940.0, 0.548), (1064.0, 0.569), (1550.0, 0.253)];

/// Conifers \[ASTER\].
const NEEDLES: &[(f64, f64)] =
    &[(850.0, 0.515), (905.0, 0.515), (940.0, 0.504), (1064.0, 0.524), (1550.0, 0.188)];

/// Rounded to 0.05 after the shape of the mean forearm of \[CAT17\]: ours.
const SKIN: &[(f64, f64)] =
    &[(850.0, 0.60), (905.0, 0.60), (940.0, 0.55), (1064.0, 0.60), (1550.0, 0.10)];

/// Weathered aluminium \[ASTER\].
const ALUMINIUM: &[(f64, f64)] =
    &[(850.0, 0.538), (905.0, 0.596), (940.0, 0.628), (1064.0, 0.710), (1550.0, 0.813)];

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

    const NM_905: f64 = 905e-9;

    #[test]
    fn reflectance_goes_by_wavelength() {
        let at = |name: &str, nm: f64| named(name).unwrap().at(nm * 1e-9).diffuse;
        approx::assert_relative_eq!(at("asphalt", 905.0), 0.109, max_relative = 1e-12);
        approx::assert_relative_eq!(at("asphalt", 922.5), 0.1095, max_relative = 1e-9);
        approx::assert_relative_eq!(at("grass", 1550.0), 0.243, max_relative = 1e-12);
        // Beyond what is known, as at its end.
        assert_eq!([300.0, 2000.0].map(|nm| at("snow", nm)), [0.78, 0.05]);
        assert_eq!([300.0, 2000.0].map(|nm| at("brick", nm)), [0.45, 0.45]);
        for (name, diffuse, ..) in LIBRARY {
            let Diffuse::At(known) = diffuse else { continue };
            assert!(known.is_sorted_by(|one, next| one.0 < next.0), "{name}");
        }
    }

    /// A coefficient of retroreflection of 250 cd/lx/m² is 785 times that of white.
    #[test]
    fn sheeting_sends_back_by_its_coefficient() {
        let sign = named("road-sign").unwrap().at(NM_905);
        approx::assert_relative_eq!(sign.backscatter(1.0), 785.4 + 0.4, max_relative = 1e-4);
    }

    #[test]
    fn white_sends_everything_back_by_the_cosine() {
        let white = named("white").unwrap().at(NM_905);
        assert_eq!(white.backscatter(1.0), 1.0);
        assert_eq!(white.backscatter(0.25), 0.25);
        assert_eq!(white.backscatter(0.0), 0.0);
    }

    #[test]
    fn seen_from_the_source_it_scatters_what_it_sends_back_but_for_retroreflectors() {
        for material in library().map(|material| material.at(NM_905)) {
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
        let chrome = named("chrome").unwrap().at(NM_905);
        assert!(chrome.scatter(0.87, 1.0) > 100.0 * chrome.scatter(0.71, 0.97));
    }

    #[test]
    fn a_lobe_is_bright_only_square_on() {
        let paint = named("paint-black").unwrap().at(NM_905);
        assert!(paint.backscatter(1.0) > 1.0);
        // 20° off, cos²⁰⁰ has left nothing but the pigment.
        let off = 20f64.to_radians().cos();
        approx::assert_relative_eq!(paint.backscatter(off), 0.05 * off, max_relative = 1e-3);
    }

    #[test]
    fn what_is_left_out_far_off_the_lobe_changes_no_bit() {
        let mut left_out = 0;
        for material in library().filter(|material| material.specular > 0.0) {
            let finish = material.at(NM_905);
            let Finish { diffuse, specular, gloss, retro } = finish;
            for i in 0..=1000 {
                let cosine = f64::from(i) / 1000.0;
                let whole = (diffuse + retro) * cosine + specular * libm::pow(cosine, gloss);
                assert_eq!(finish.backscatter(cosine).to_bits(), whole.to_bits());
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
            for nm in [300.0, 905.0, 1064.0, 1550.0, 2000.0] {
                let sum = material.at(nm * 1e-9).diffuse + mirrored + material.transmission;
                assert!(sum <= 1.0 + 1e-12, "{} sends out {sum} at {nm} nm", material.name);
            }
        }
    }

    #[test]
    fn names_are_forgiving_and_typing_errors_are_seen_through() {
        assert_eq!(named("Number Plate").unwrap().name, "number-plate");
        assert_eq!(named("asphlat"), None);
    }
}

//! What rays meet: the seam between the scene and the channel.

/// A half-line. The direction has unit length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Start, m.
    pub origin: [f64; 3],
    /// Unit vector.
    pub direction: [f64; 3],
}

/// The nearest surface a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin, m.
    pub range: f64,
    /// Unit normal of the surface as modelled; either side may face the ray.
    pub normal: [f64; 3],
    /// Index into `Scene::materials`.
    pub material: u16,
    /// Index into `Scene::objects`.
    pub object: u16,
}

/// Anything that can be hit by rays: triangle meshes, or closed-form shapes as their oracle.
pub trait CastRays: Send + Sync {
    /// The nearest hit with `range` in (`nearest`, `farthest`), in metres.
    fn cast(&self, ray: &Ray, nearest: f64, farthest: f64) -> Option<Hit>;
}

/// What the light of a band of shots meets, as columns; ordered by shot, then by ray, then by
/// range. Truth: never handed to the receiver.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hits {
    /// Index of the shot in the band's log.
    pub shot: Vec<u32>,
    /// Fraction of the shot's energy that arrives here and, by the same way, returns: the ray's
    /// share of the footprint times the two-way transmission of the glass before it.
    pub weight: Vec<f32>,
    /// Distance from the sensor, m.
    pub range: Vec<f64>,
    /// Cosine of the incidence angle, 0…1.
    pub cosine: Vec<f32>,
    /// Index into `Scene::materials`.
    pub material: Vec<u16>,
    /// Index into `Scene::objects`.
    pub object: Vec<u16>,
}

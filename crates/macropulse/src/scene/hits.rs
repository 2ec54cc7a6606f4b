//! Hits of rays: the seam between the scene and the channel.

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

/// Surfaces that the light of a band of shots meets, as columns; ordered by shot, then by ray, then by range.
/// Truth: never handed to the receiver.
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
    /// How fast the surface approaches, m/s; empty for a sensor whose light does not show it.
    pub radial_velocity: Vec<f32>,
}

impl Hits {
    /// The same hits ordered by shot, for this number of `shots`; those of one shot stay in their order.
    pub(super) fn by_shot(self, shots: usize) -> Self {
        let mut next = vec![0_u32; shots + 1];
        self.shot.iter().for_each(|shot| next[*shot as usize + 1] += 1);
        (0..shots).for_each(|shot| next[shot + 1] += next[shot]);
        let mut order = vec![0_u32; self.shot.len()];
        for (index, shot) in (0..).zip(&self.shot) {
            let place = &mut next[*shot as usize];
            order[*place as usize] = index;
            *place += 1;
        }
        Self {
            shot: ordered(&self.shot, &order),
            weight: ordered(&self.weight, &order),
            range: ordered(&self.range, &order),
            cosine: ordered(&self.cosine, &order),
            material: ordered(&self.material, &order),
            object: ordered(&self.object, &order),
            radial_velocity: Vec::new(),
        }
    }
}

/// The values of a column in the `order` of their indices.
fn ordered<T: Copy>(column: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|index| column[*index as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hits_come_by_shot_and_then_as_they_were() {
        let shot = vec![2, 0, 2, 3, 0, 0];
        let range: Vec<f64> = (0..6).map(f64::from).collect();
        let column = |of: fn(usize) -> u16| (0..6).map(of).collect::<Vec<u16>>();
        let hits = Hits {
            weight: vec![1.0; 6],
            cosine: range.iter().map(|range| *range as f32).collect(),
            material: column(|i| i as u16),
            object: column(|i| 9 - i as u16),
            shot,
            range,
            ..Hits::default()
        };
        let by_shot = hits.by_shot(5);
        assert_eq!(by_shot.shot, [0, 0, 0, 2, 2, 3]);
        assert_eq!(by_shot.range, [1.0, 4.0, 5.0, 0.0, 2.0, 3.0]);
        assert_eq!(by_shot.cosine, [1.0, 4.0, 5.0, 0.0, 2.0, 3.0]);
        assert_eq!(by_shot.material, [1, 4, 5, 0, 2, 3]);
        assert_eq!(by_shot.object, [8, 5, 4, 9, 7, 6]);
        assert_eq!(Hits::default().by_shot(3), Hits::default());
    }
}

//! A point cloud as dots seen from anywhere.

use super::Error;
use super::canvas::Canvas;
use super::colour::{NIGHT, mix, place, range_colour};

/// Larger dots would hide the cloud.
const LARGEST_DOT: usize = 64;

/// Position and direction from which a picture is taken. Metres, in the frame of the cloud, z up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewpoint {
    /// Place of the eye.
    pub eye: [f64; 3],
    /// The point in the middle of the picture.
    pub target: [f64; 3],
    /// Horizontal angle of view, rad.
    pub field: f64,
}

/// A perspective picture of points, coloured by range.
#[derive(Debug, Clone, PartialEq)]
pub struct CloudPicture<'a> {
    /// x, y and z of the points, m; NaN where there is none.
    pub points: [&'a [f32]; 3],
    /// Range of the points, m.
    pub range: &'a [f32],
    /// Ranges at the ends of the colours, m.
    pub ends: [f32; 2],
    /// Position and direction from which the picture is taken.
    pub viewpoint: Viewpoint,
    /// Width and height of the picture in pixels.
    pub size: [usize; 2],
    /// Diameter of a dot in pixels.
    pub dot: usize,
}

impl CloudPicture<'_> {
    /// The picture as PNG. Far dots are drawn first, so near ones cover them; they also fade a
    /// little with the distance to the eye.
    ///
    /// # Errors
    /// [`Error::Ragged`] if the columns differ in length, [`Error::Size`] if the picture is empty
    /// or too large.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        let [x, y, z] = self.points;
        if [y.len(), z.len(), self.range.len()].iter().any(|length| *length != x.len()) {
            return Err(Error::Ragged);
        }
        let mut canvas = Canvas::new(self.size[0], self.size[1])?;
        let camera = Camera::new(&self.viewpoint, self.size);
        let mut seen: Vec<_> = (0..x.len())
            .filter_map(|at| {
                camera.project([x[at], y[at], z[at]].map(f64::from)).map(|dot| (dot, at))
            })
            .collect();
        seen.sort_by(|(a, i), (b, j)| b.depth.total_cmp(&a.depth).then(i.cmp(j)));
        let depths = [seen.last(), seen.first()].map(|end| end.map_or(0.0, |(dot, _)| dot.depth));
        for (dot, at) in seen {
            let colour = range_colour(place(self.range[at], self.ends[0], self.ends[1]));
            let share = (dot.depth - depths[0]) / (depths[1] - depths[0]).max(f64::MIN_POSITIVE);
            self.stamp(&mut canvas, dot, mix(colour, NIGHT, 0.35 * share));
        }
        canvas.png()
    }

    /// A round dot; pixels whose centre lies outside the circle stay.
    fn stamp(&self, canvas: &mut Canvas, dot: Dot, colour: [u8; 3]) {
        let diameter = self.dot.min(LARGEST_DOT);
        let reach = diameter as i64 / 2;
        let radius = diameter as f64 / 2.0;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let inside = ((dx * dx + dy * dy) as f64) < radius * radius + 0.25;
                let place = [dot.x as i64 + dx, dot.y as i64 + dy].map(usize::try_from);
                if let ([Ok(x), Ok(y)], true) = (place, inside) {
                    canvas.put(x, y, colour);
                }
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Dot {
    x: f64,
    y: f64,
    depth: f64,
}

struct Camera {
    eye: glam::DVec3,
    forward: glam::DVec3,
    right: glam::DVec3,
    up: glam::DVec3,
    size: [f64; 2],
    /// Pixels per unit of tangent.
    focal: f64,
}

impl Camera {
    fn new(view: &Viewpoint, size: [usize; 2]) -> Self {
        let eye = glam::DVec3::from(view.eye);
        let forward = (glam::DVec3::from(view.target) - eye).normalize_or(glam::DVec3::X);
        // Straight up or down there is no "right"; any will do.
        let right = forward.cross(glam::DVec3::Z).normalize_or(glam::DVec3::NEG_Y);
        let size = size.map(|length| length as f64);
        let half = libm::tan(view.field.clamp(1e-3, 3.0) / 2.0);
        Self { eye, forward, right, up: right.cross(forward), size, focal: size[0] / 2.0 / half }
    }

    /// The place of a point in the picture; `None` if it is behind the eye or outside.
    fn project(&self, point: [f64; 3]) -> Option<Dot> {
        let offset = glam::DVec3::from(point) - self.eye;
        let depth = offset.dot(self.forward);
        if depth.is_nan() || depth < 0.05 {
            return None;
        }
        let x = self.size[0] / 2.0 + self.focal * offset.dot(self.right) / depth;
        let y = self.size[1] / 2.0 - self.focal * offset.dot(self.up) / depth;
        let inside = (0.0..self.size[0]).contains(&x) && (0.0..self.size[1]).contains(&y);
        inside.then_some(Dot { x, y, depth })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AHEAD: Viewpoint =
        Viewpoint { eye: [0.0; 3], target: [10.0, 0.0, 0.0], field: std::f64::consts::FRAC_PI_2 };

    #[test]
    fn left_is_left_and_up_is_up() {
        let camera = Camera::new(&AHEAD, [200, 100]);
        let dot = camera.project([10.0, 5.0, 2.0]).unwrap();
        approx::assert_relative_eq!(dot.x, 50.0, epsilon = 1e-9);
        approx::assert_relative_eq!(dot.y, 30.0, epsilon = 1e-9);
        assert_eq!(dot.depth, 10.0);
    }

    #[test]
    fn what_is_behind_or_nowhere_is_not_seen() {
        let camera = Camera::new(&AHEAD, [200, 100]);
        assert_eq!(camera.project([-1.0, 0.0, 0.0]), None);
        assert_eq!(camera.project([f64::NAN, 0.0, 0.0]), None);
        assert_eq!(camera.project([1.0, 3.0, 0.0]), None);
    }

    #[test]
    fn the_order_of_the_points_does_not_matter_but_their_depth_does() {
        let png = |x: [f32; 2]| {
            CloudPicture {
                points: [&x, &[0.0; 2], &[0.0; 2]],
                range: &x,
                ends: [0.0, 20.0],
                viewpoint: AHEAD,
                size: [21, 21],
                dot: 3,
            }
            .png()
            .unwrap()
        };
        assert_eq!(png([5.0, 15.0]), png([15.0, 5.0]));
        assert_ne!(png([5.0, 15.0]), png([15.0, 15.0]));
    }

    #[test]
    fn ragged_columns_are_refused() {
        let picture = CloudPicture {
            points: [&[1.0], &[], &[1.0]],
            range: &[1.0],
            ends: [0.0, 1.0],
            viewpoint: AHEAD,
            size: [9, 9],
            dot: 1,
        };
        assert!(matches!(picture.png(), Err(Error::Ragged)));
    }
}

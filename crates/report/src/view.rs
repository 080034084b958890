//! View of the box of a three-dimensional plot.

use mops_math as math;

use super::clip::Point;

/// Point in the box, `[x, y, z]` with z upwards; each coordinate is from -1 to 1.
pub(super) type Point3 = [f64; 3];

/// View of the box, in parallel projection.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// Azimuth: rotation about the vertical axis, rad.
    pub(super) azimuth: f64,
    /// Elevation of the viewpoint above the floor, rad.
    pub(super) elevation: f64,
    /// Units of the drawing per unit of the box.
    pub(super) scale: f64,
    /// Centre of the box on the drawing.
    pub(super) centre: Point,
}

impl View {
    /// Returns the position of a point on the drawing.
    pub(super) fn project(&self, [x, y, z]: Point3) -> Point {
        let (sin, cos) = (math::sin(self.azimuth), math::cos(self.azimuth));
        let (across, depth) = (x * cos - y * sin, x * sin + y * cos);
        let up = z * math::cos(self.elevation) + depth * math::sin(self.elevation);
        [self.centre[0] + self.scale * across, self.centre[1] - self.scale * up]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_top_view_shows_x_and_y_undistorted_and_the_side_view_x_and_z() {
        let above = View { azimuth: 0.0, elevation: std::f64::consts::FRAC_PI_2, scale: 1.0, centre: [0.0, 0.0] };
        let side = View { elevation: 0.0, ..above };
        let near = |a: Point, b: Point| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-12;
        assert!(near(above.project([0.5, 0.25, 0.7]), [0.5, -0.25]));
        assert!(near(side.project([0.5, 0.25, 0.7]), [0.5, -0.7]));
    }
}

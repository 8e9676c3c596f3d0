//! Solids and sheets: boxes, lathed profiles, ellipsoids, tubes, arches and picture frames.

use crate::mesh::TriangleMesh;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// A closed box.
pub fn block(min: DVec3, max: DVec3) -> TriangleMesh {
    let p = |x: u8, y: u8, z: u8| {
        let pick = |bit: u8, low: f64, high: f64| if bit == 0 { low } else { high };
        DVec3::new(pick(x, min.x, max.x), pick(y, min.y, max.y), pick(z, min.z, max.z))
    };
    let mut mesh = TriangleMesh::new();
    mesh.quad([p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)]);
    mesh.quad([p(1, 0, 0), p(0, 0, 0), p(0, 1, 0), p(1, 1, 0)]);
    mesh.quad([p(1, 0, 1), p(1, 0, 0), p(1, 1, 0), p(1, 1, 1)]);
    mesh.quad([p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0)]);
    mesh.quad([p(0, 1, 1), p(1, 1, 1), p(1, 1, 0), p(0, 1, 0)]);
    mesh.quad([p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1)]);
    mesh
}

/// A box that stands on the floor, by its middle and full extents.
pub fn standing_block(x: f64, z: f64, size: DVec3) -> TriangleMesh {
    let half = DVec3::new(size.x / 2.0, 0.0, size.z / 2.0);
    block(DVec3::new(x, 0.0, z) - half, DVec3::new(x, size.y, z) + half)
}

/// A grid of `columns` × `rows` quadrilaterals through `at(column, row)`. Its front is where columns run to the right
/// and rows run up. When `closed`, the last column meets the first.
pub fn surface(columns: usize, rows: usize, closed: bool, at: impl Fn(usize, usize) -> DVec3) -> TriangleMesh {
    let mut mesh = TriangleMesh::new();
    let wrap = |column: usize| if closed { column % columns } else { column };
    for row in 0..rows {
        for column in 0..columns {
            let (left, right) = (wrap(column), wrap(column + 1));
            mesh.quad([at(left, row), at(right, row), at(right, row + 1), at(left, row + 1)]);
        }
    }
    mesh
}

/// A point on the unit circle round +Y, the `index`-th of `sides`, counter-clockwise from above.
pub fn around(index: usize, sides: usize) -> DVec2 {
    let angle = TAU * index as f64 / sides as f64;
    DVec2::new(angle.cos(), -angle.sin())
}

/// A profile of (radius, height), from the bottom up, turned round +Y. Radius 0 closes an end.
pub fn lathe(profile: &[(f64, f64)], sides: usize) -> TriangleMesh {
    surface(sides, profile.len() - 1, true, |column, row| {
        let (radius, height) = profile[row];
        let direction = around(column, sides) * radius;
        DVec3::new(direction.x, height, direction.y)
    })
}

/// A smooth profile through the given (radius, height) points, `steps` a span (Catmull-Rom).
pub fn smooth_profile(points: &[(f64, f64)], steps: usize) -> Vec<(f64, f64)> {
    let point = |i: usize| DVec2::new(points[i].0, points[i].1);
    let last = points.len() - 1;
    let mut out = Vec::new();
    for i in 0..last {
        let (before, a, b, after) = (point(i.saturating_sub(1)), point(i), point(i + 1), point((i + 2).min(last)));
        for step in 0..steps {
            let t = step as f64 / steps as f64;
            let tangents = (b - before, after - a);
            let p = a
                + 0.5 * t * tangents.0
                + t * t * (3.0 * (b - a) - tangents.0 - 0.5 * tangents.1)
                + t * t * t * (2.0 * (a - b) + 0.5 * (tangents.0 + tangents.1));
            out.push((p.x.max(0.0), p.y));
        }
    }
    out.push(points[last]);
    out
}

pub fn ellipsoid(center: DVec3, radii: DVec3, sides: usize, rows: usize) -> TriangleMesh {
    surface(sides, rows, true, |column, row| {
        let latitude = PI * (row as f64 / rows as f64 - 0.5);
        let across = if row == 0 || row == rows { DVec2::ZERO } else { around(column, sides) * latitude.cos() };
        center + radii * DVec3::new(across.x, latitude.sin(), across.y)
    })
}

/// A round tube along points with radii; radius 0 closes an end. When `closed` the last point joins the first.
pub fn tube(path: &[(DVec3, f64)], sides: usize, closed: bool) -> TriangleMesh {
    let count = path.len();
    let tangent = |i: usize| {
        let (before, after) = if closed {
            ((i + count - 1) % count, (i + 1) % count)
        } else {
            (i.saturating_sub(1), (i + 1).min(count - 1))
        };
        (path[after].0 - path[before].0).normalize()
    };
    // The ring turns as little as it can from point to point, so that the tube does not twist.
    let mut across = Vec::with_capacity(count);
    let mut previous = tangent(0).any_orthonormal_vector();
    for i in 0..count {
        previous = previous.reject_from_normalized(tangent(i)).normalize();
        across.push(previous);
    }
    // Over a closed path the turning leaves a gap between the last ring and the first; each ring takes its share.
    let gap = if closed {
        let end = across[count - 1].reject_from_normalized(tangent(0)).normalize();
        across[0].cross(end).dot(tangent(0)).atan2(across[0].dot(end))
    } else {
        0.0
    };
    let ring = |i: usize, side: usize| {
        let angle = TAU * side as f64 / sides as f64 - gap * i as f64 / count as f64;
        let (u, v) = (across[i], tangent(i).cross(across[i]));
        path[i].0 + (u * angle.cos() + v * angle.sin()) * path[i].1
    };
    let rows = if closed { count } else { count - 1 };
    surface(sides, rows, true, |side, row| ring(row % count, side))
}

/// The measures of a wall with a round-arched opening, in metres.
#[derive(Debug, Clone, Copy)]
pub struct Arch {
    pub width: f64,
    /// The wall's lower edge: at the springing it rests on columns, at 0 on the floor.
    pub bottom: f64,
    pub springing: f64,
    pub top: f64,
    /// Half the opening's width.
    pub radius: f64,
    pub thickness: f64,
    pub segments: usize,
}

impl Arch {
    /// The point of the arch's curve at a segment, from the right springing over to the left.
    fn curve(&self, segment: usize) -> DVec2 {
        let angle = PI * segment as f64 / self.segments as f64;
        DVec2::new(0.0, self.springing) + self.radius * DVec2::new(angle.cos(), angle.sin())
    }

    /// The wall along X, in the middle of Z. Its top is open, to meet a ceiling; so are its ends when
    /// it rests on columns, to meet its neighbours.
    pub fn wall(&self) -> TriangleMesh {
        let depth = self.thickness / 2.0;
        let half = self.width / 2.0;
        let mut face = TriangleMesh::new();
        let on = |x: f64, y: f64| DVec3::new(x, y, depth);
        for (inner, outer) in [(self.radius, half), (-half, -self.radius)] {
            face.quad([on(inner, self.bottom), on(outer, self.bottom), on(outer, self.top), on(inner, self.top)]);
        }
        for segment in 0..self.segments {
            let (right, left) = (self.curve(segment), self.curve(segment + 1));
            face.quad([on(left.x, left.y), on(right.x, right.y), on(right.x, self.top), on(left.x, self.top)]);
        }
        let mut mesh = face.clone();
        mesh.add(face.transformed(glam::DAffine3::from_rotation_y(PI)));
        mesh.add(surface(self.segments, 1, false, |segment, row| {
            self.curve(segment).extend(if row == 0 { depth } else { -depth })
        }));
        let jamb = |side: f64| {
            let (near, far) = (DVec3::new(side, self.bottom, depth), DVec3::new(side, self.bottom, -depth));
            let up = DVec3::Y * (self.springing - self.bottom);
            if side > 0.0 { [near, near + up, far + up, far] } else { [near, far, far + up, near + up] }
        };
        mesh.quad(jamb(self.radius));
        mesh.quad(jamb(-self.radius));
        if self.bottom > 0.0 {
            for (from, to) in [(self.radius, half), (-half, -self.radius)] {
                let at = |x: f64, z: f64| DVec3::new(x, self.bottom, z);
                mesh.quad([at(from, -depth), at(to, -depth), at(to, depth), at(from, depth)]);
            }
        } else {
            for side in [half, -half] {
                let at = |y: f64, z: f64| DVec3::new(side, y, z * side.signum());
                mesh.quad([at(0.0, depth), at(0.0, -depth), at(self.top, -depth), at(self.top, depth)]);
            }
        }
        mesh
    }

    /// A raised moulding round the opening on the +Z side, `width` wide and `depth` proud of the wall.
    pub fn moulding(&self, width: f64, depth: f64) -> TriangleMesh {
        let base = self.thickness / 2.0;
        let profile = [(0.0, base), (0.0, base + depth), (width, base + depth), (width, base)];
        surface(self.segments, profile.len() - 1, false, |segment, row| {
            let (offset, z) = profile[row];
            let center = DVec2::new(0.0, self.springing);
            let radial = (self.curve(segment) - center).normalize();
            (center + radial * (self.radius + offset)).extend(z)
        })
        .inside_out()
    }
}

/// A picture frame round an opening of `width` × `height` in the XY plane, facing +Z. `profile` gives (distance from
/// the opening, height above the wall), from the outer back edge over the front to the opening.
pub fn frame(width: f64, height: f64, profile: &[(f64, f64)]) -> TriangleMesh {
    let corners = [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)];
    surface(4, profile.len() - 1, true, |corner, row| {
        let (x, y) = corners[corner];
        let (offset, z) = profile[row];
        DVec3::new(x * (width / 2.0 + offset), y * (height / 2.0 + offset), z)
    })
}

/// An upright rectangle in the XY plane, facing +Z, round the origin.
pub fn panel(width: f64, height: f64) -> TriangleMesh {
    let (x, y) = (width / 2.0, height / 2.0);
    let mut mesh = TriangleMesh::new();
    mesh.quad([DVec3::new(-x, -y, 0.0), DVec3::new(x, -y, 0.0), DVec3::new(x, y, 0.0), DVec3::new(-x, y, 0.0)]);
    mesh
}

/// An opening of a wall: from and to along the wall, from and to above its foot. Metres.
pub type Opening = [f64; 4];

/// A wall along +X from the origin, its thickness about the middle of Z, with openings that do not overlap along it.
pub fn pierced_wall(length: f64, height: f64, thickness: f64, openings: &[Opening]) -> TriangleMesh {
    let depth = thickness / 2.0;
    let mut mesh = TriangleMesh::new();
    let mut part = |from: f64, to: f64, low: f64, high: f64| {
        if to > from && high > low {
            mesh.add(block(DVec3::new(from, low, -depth), DVec3::new(to, high, depth)));
        }
    };
    let mut reached = 0.0;
    for &[from, to, low, high] in openings {
        part(reached, from, 0.0, height);
        part(from, to, 0.0, low);
        part(from, to, high, height);
        reached = to;
    }
    part(reached, length, 0.0, height);
    mesh
}

/// A horizontal rectangle that faces up, in `columns` × `rows` squares that each carry the whole of a texture.
pub fn tiles(min: DVec3, size: DVec2, columns: usize, rows: usize) -> TriangleMesh {
    let step = size / DVec2::new(columns as f64, rows as f64);
    let mut mesh = TriangleMesh::new();
    for row in 0..rows {
        for column in 0..columns {
            let low = min + DVec3::new(step.x * column as f64, 0.0, step.y * row as f64);
            let p = |x: f64, z: f64| low + DVec3::new(x * step.x, 0.0, z * step.y);
            mesh.quad([p(0.0, 1.0), p(1.0, 1.0), p(1.0, 0.0), p(0.0, 0.0)]);
        }
    }
    mesh
}

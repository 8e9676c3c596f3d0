//! The hierarchy of boxes, against every triangle one by one.

use crate::scene::{
    Bounds,
    bvh::{Bvh, MAX_DEPTH, Refit, Tree, margin},
};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Numbers in 0..1 from a fixed seed (PCG, O'Neill 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = (((self.0 >> 18) ^ self.0) >> 27) as u32;
        (word.rotate_right((self.0 >> 59) as u32) >> 8) as f32 / (1 << 24) as f32
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

/// A row of a hierarchy.
struct Node {
    bounds: Bounds,
    first: u32,
    count: u32,
}

impl Node {
    fn of(bvh: &Bvh, row: usize) -> Node {
        let bounds = Bounds { min: bvh.lower[row], max: bvh.upper[row] };
        Node { bounds, first: bvh.tree.first[row], count: bvh.tree.count[row] }
    }
}

/// Distance along a ray to a triangle, by its edges' volumes, as shaders/lib/trace.wgsl has it.
fn meet(origin: Vec3, direction: Vec3, triangle: [Vec3; 3]) -> Option<f64> {
    let d = direction.as_dvec3();
    let [a, b, c]: [DVec3; 3] = triangle.map(|p| p.as_dvec3() - origin.as_dvec3());
    let [u, v, w] = [c.cross(b).dot(d), a.cross(c).dot(d), b.cross(a).dot(d)];
    let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    let normal = (b - a).cross(c - a);
    let t = normal.dot(a) / normal.dot(d);
    (inside && normal.dot(d) != 0.0 && t > 0.0).then_some(t)
}

/// The nearest triangle by the hierarchy: its distance, and the most boxes that waited at a time.
fn trace(bvh: &Bvh, triangles: &[[Vec3; 3]], origin: Vec3, direction: Vec3) -> (f64, usize) {
    let mut best = f64::INFINITY;
    let mut waiting = vec![0];
    let mut most = 0;
    while let Some(row) = waiting.pop() {
        let node = Node::of(bvh, row);
        let (low, high) = ((node.bounds.min - origin) / direction, (node.bounds.max - origin) / direction);
        let (enter, leave) = (low.min(high).max_element().max(0.0), low.max(high).min_element());
        if enter > leave || f64::from(enter) > best {
            continue;
        }
        if node.count == 0 {
            waiting.extend([node.first as usize + 1, node.first as usize]);
            most = most.max(waiting.len());
            continue;
        }
        for place in node.first..node.first + node.count {
            let triangle = triangles[bvh.tree.order[place as usize] as usize];
            best = best.min(meet(origin, direction, triangle).unwrap_or(f64::INFINITY));
        }
    }
    (best, most)
}

/// Every triangle is in one leaf, and every box holds what is below it.
fn check_structure(bvh: &Bvh, triangles: &[[Vec3; 3]]) {
    let mut seen = vec![0; triangles.len()];
    let mut below = vec![(0, 0, Node::of(bvh, 0).bounds)];
    while let Some((row, depth, outer)) = below.pop() {
        let node = Node::of(bvh, row);
        assert!(depth <= MAX_DEPTH);
        assert!(node.bounds.min.cmpge(outer.min).all() && node.bounds.max.cmple(outer.max).all());
        if node.count == 0 {
            assert!(node.first as usize > row);
            below.extend([0, 1].map(|i| (node.first as usize + i, depth + 1, node.bounds)));
            continue;
        }
        for place in node.first..node.first + node.count {
            let triangle = bvh.tree.order[place as usize] as usize;
            assert_eq!(triangle as u32 % 3, bvh.tree.order[node.first as usize] % 3, "a leaf is of one node");
            seen[triangle] += 1;
            for p in triangles[triangle] {
                assert!(p.cmpge(node.bounds.min).all() && p.cmple(node.bounds.max).all());
            }
        }
    }
    assert!(seen.iter().all(|n| *n == 1));
}

/// Over triangles of three nodes.
fn hierarchy(triangles: &[[Vec3; 3]]) -> Bvh {
    let tree = Tree::new(triangles.len(), |i| triangles[i], |i| i as u32 % 3, 1);
    Bvh::of(tree, Bounds::of(triangles.iter().flatten().copied()), |i| triangles[i])
}

fn check_rays(triangles: &[[Vec3; 3]], rays: usize) {
    let bvh = hierarchy(triangles);
    check_structure(&bvh, triangles);
    assert_eq!(bvh, hierarchy(triangles), "the same triangles give the same hierarchy");
    let mut random = Random(7);
    let mut hits = 0;
    for _ in 0..rays {
        let origin = random.point() * 2.0 - 0.5;
        let direction = (random.point() - 0.5).normalize();
        let nearest =
            triangles.iter().filter_map(|t| meet(origin, direction, *t)).fold(f64::INFINITY, |best, t| best.min(t));
        let (found, most) = trace(&bvh, triangles, origin, direction);
        assert_eq!(found, nearest, "from {origin} along {direction}");
        assert!(most <= MAX_DEPTH as usize + 1);
        hits += usize::from(nearest.is_finite());
    }
    assert!(hits > rays / 100, "only {hits} of {rays} rays met anything");
}

#[test]
fn the_hierarchy_finds_what_a_search_of_all_finds() {
    let mut random = Random(1);
    let soup: Vec<[Vec3; 3]> = (0..700)
        .map(|_| {
            let centre = random.point();
            [0; 3].map(|_| centre + 0.2 * (random.point() - 0.5))
        })
        .collect();
    check_rays(&soup, 2000);
}

#[test]
fn flat_equal_and_lopsided_triangles_are_found_too() {
    let mut random = Random(3);
    // A sheet in a plane through an axis: boxes without thickness.
    let mut triangles: Vec<[Vec3; 3]> = (0..100)
        .map(|i| {
            let at = Vec3::new((i % 10) as f32, 0.0, (i / 10) as f32) * 0.1;
            [at, at + 0.1 * Vec3::Z, at + 0.1 * Vec3::X]
        })
        .collect();
    // Thirty in the same place, and points and lines, which nothing meets.
    triangles.extend([[Vec3::ZERO, Vec3::X, Vec3::Y]; 30]);
    triangles.extend([[Vec3::splat(0.5); 3], [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X]]);
    triangles.extend((0..30).map(|i| shrunk(&mut random, i)));
    check_rays(&triangles, 2000);
}

/// A triangle of the size 2 to the power of −`halvings`, near the origin.
fn shrunk(random: &mut Random, halvings: u32) -> [Vec3; 3] {
    [0; 3].map(|_| random.point() * (-(halvings as f32)).exp2())
}

#[test]
fn bins_that_peel_off_a_few_at_a_time_do_not_make_it_too_deep() {
    let mut random = Random(9);
    // Sizes over the whole range of f32, and a crowd at the small end.
    let mut triangles: Vec<_> = (0..126).map(|i| shrunk(&mut random, i)).collect();
    triangles.extend((0..5000).map(|i| shrunk(&mut random, 100 + i % 26)));
    check_structure(&hierarchy(&triangles), &triangles);
}

#[test]
fn nothing_is_one_leaf_with_the_zeroed_row() {
    let bvh = hierarchy(&[]);
    assert_eq!((bvh.tree.rows(), bvh.tree.count[0], bvh.tree.order.len()), (1, 1, 0));
    assert_eq!(meet(Vec3::ONE, -Vec3::ONE.normalize(), [Vec3::ZERO; 3]), None);
}

#[test]
#[ignore = "a measurement: run with --release -- --ignored --nocapture"]
fn a_million_triangles() {
    let mut random = Random(5);
    let triangles: Vec<[Vec3; 3]> = (0..1_000_000)
        .map(|_| {
            let centre = random.point();
            [0; 3].map(|_| centre + 0.01 * (random.point() - 0.5))
        })
        .collect();
    let start = std::time::Instant::now();
    let bvh = hierarchy(&triangles);
    println!("{} boxes in {:.2} s", bvh.tree.rows(), start.elapsed().as_secs_f64());
}

#[test]
fn many_triangles_are_sorted_in_parts_and_none_is_lost() {
    let mut random = Random(11);
    let triangles: Vec<[Vec3; 3]> = (0..60_000)
        .map(|_| {
            let centre = random.point();
            [0; 3].map(|_| centre + 0.02 * (random.point() - 0.5))
        })
        .collect();
    check_rays(&triangles, 20);
}

#[test]
fn after_a_move_the_boxes_are_those_that_would_be_made_anew() {
    let mut random = Random(13);
    let mut triangles: Vec<[Vec3; 3]> = (0..6000)
        .map(|_| {
            let centre = random.point();
            [0; 3].map(|_| centre + 0.02 * (random.point() - 0.5))
        })
        .collect();
    // Of node 1 but a corner of the soup: what does not move lies among it all the same.
    let ours = |triangle: usize, at: Vec3| triangle % 3 == 1 && at.max_element() < 0.3;
    let moving: Vec<usize> = (0..triangles.len()).filter(|i| ours(*i, triangles[*i][0])).collect();
    let node = |i: usize| if moving.contains(&i) { 3 } else { i as u32 % 3 };
    let all = Bounds { min: Vec3::splat(-2.0), max: Vec3::splat(2.0) };
    let tree = Tree::new(triangles.len(), |i| triangles[i], node, 1);
    let mut before = Bvh::of(tree.clone(), all, |i| triangles[i]);
    for by in [Vec3::X * 0.01, Vec3::NEG_Y, Vec3::ZERO, Vec3::new(-0.3, 1.2, 0.5)] {
        for i in &moving {
            triangles[*i] = triangles[*i].map(|p| p + by);
        }
        let anew = Bvh::of(tree.clone(), all, |i| triangles[i]);
        let moved = |place: &usize| moving.contains(&(tree.order[*place] as usize));
        let places: Vec<Range<usize>> = (0..triangles.len()).filter(moved).map(|place| place..place + 1).collect();
        let list = tree.refit(places);
        let after = fitted(before, &list, all, &triangles);
        assert_eq!(after, anew);
        assert!(list.rows.len() < tree.rows() / 2, "{} of {}", list.rows.len(), tree.rows());
        let spanned = list.spans.iter().cloned().flatten().collect::<Vec<_>>();
        let mut numbers: Vec<usize> = list.rows.iter().map(|[row, ..]| *row as usize).collect();
        numbers.sort_unstable();
        assert_eq!(spanned, numbers);
        before = after;
    }
}

/// What src/gpu/refit.wgsl does.
fn fitted(mut bvh: Bvh, list: &Refit, all: Bounds, triangles: &[[Vec3; 3]]) -> Bvh {
    let wider = Vec3::splat(margin(all));
    let mut start = 0;
    for end in &list.ends {
        let level = &list.rows[start..*end as usize];
        let made: Vec<(Vec3, Vec3)> = level
            .iter()
            .map(|[_, first, count]| {
                let (first, count) = (*first as usize, *count as usize);
                if count == 0 {
                    let (lower, upper) = (&bvh.lower, &bvh.upper);
                    return (lower[first].min(lower[first + 1]), upper[first].max(upper[first + 1]));
                }
                let of = bvh.tree.order[first..first + count].iter().flat_map(|i| triangles[*i as usize]);
                let exact = Bounds::of(of);
                (exact.min - wider, exact.max + wider)
            })
            .collect();
        for ([row, ..], (lower, upper)) in level.iter().zip(made) {
            bvh.lower.set(*row as usize, lower);
            bvh.upper.set(*row as usize, upper);
        }
        start = *end as usize;
    }
    assert_eq!(start, list.rows.len());
    bvh
}

//! Which of some points nothing beats.

/// Indices of the points that no other is at least as good as in both coordinates and better in one; both are better
/// when smaller. By increasing x. Points that aren't finite or are negative take no part; of equal points the first
/// does.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let fits = |v: f64| v.is_finite() && v >= 0.0;
    let mut order: Vec<usize> = (0..points.len()).filter(|i| fits(points[*i].0) && fits(points[*i].1)).collect();
    order.sort_by(|a, b| {
        let (a, b) = (points[*a], points[*b]);
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let mut best = f64::INFINITY;
    order.retain(|i| {
        let better = points[*i].1 < best;
        best = best.min(points[*i].1);
        better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_nothing_beats_is_on_the_front() {
        let points = [
            (3.0, 1.0),
            (1.0, 5.0),
            (2.0, 5.0),
            (2.0, 3.0),
            (4.0, 1.0),
            (1.0, 6.0),
            (f64::NAN, 0.0),
            (0.5, f64::INFINITY),
        ];
        assert_eq!(front(&points), [1, 3, 0]);
    }

    #[test]
    fn of_equal_points_the_first_stays() {
        assert_eq!(front(&[(1.0, 1.0), (1.0, 1.0)]), [0]);
        assert_eq!(front(&[]), [0usize; 0]);
    }
}

//! The factors of the projection to spherical harmonics, as the shaders make them.

use crate::device::gpu;
use crate::support::{Scratch, repository};
use lightgraph::internals::math::{cube, sh};
use lightgraph::{Project, Scene, Session, Settings};
use std::f64::consts::PI;

/// What harmonic `j` at the texels of a cube counts in coefficient `k`: Σ factor_k · Y_j, row by row.
fn products(order: usize, face: u32, set: &str) -> Vec<f64> {
    let gpu = gpu();
    let scratch = Scratch::new("projection");
    let variant = scratch.path().join("variant.ron");
    let text = r#"Variant(base: "lightgraph:graphs/gi/uniform_grid.ron", about: "for tests", lets: {"degree": "order"}, outputs: {"factor": "factor"})"#;
    std::fs::write(&variant, text).unwrap();
    let project = Project::open(&variant, &[repository("shaders")]).unwrap_or_else(|f| panic!("{f}"));
    let set = format!("grid=1,1,1 order={order} face={face} {set}");
    let set: Vec<String> = set.split_whitespace().map(String::from).collect();
    let settings = Settings {
        params: project.params(&set).unwrap_or_else(|f| panic!("{f}")),
        size: [8, 8],
        outputs: Some(vec!["factor".into()]),
        ..Settings::default()
    };
    let scene = Scene::load(&repository("scenes/cornell.glb")).unwrap_or_else(|f| panic!("{f}")).scene;
    let mut session = Session::new(&gpu, &project, scene, settings).unwrap_or_else(|f| panic!("{f}"));
    session.frame(&gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let factor = session.image(&gpu, "factor").unwrap_or_else(|f| panic!("{f}"));
    let n = sh::count(order);
    let mut out = vec![0.0; n * n];
    for i in 0..cube::FACES * face * face {
        let (side, x, y) = (i / (face * face), i % face, i / face % face);
        let harmonics = sh::basis(order, cube::direction(side, [x, y], face));
        for k in 0..n {
            let share = f64::from(factor.pixel(k as u32 * cube::FACES + side, x, y).unwrap()[0]);
            for j in 0..n {
                out[k * n + j] += share * harmonics[j];
            }
        }
    }
    out
}

/// The largest difference from a diagonal matrix that holds `left` of each degree.
fn off(products: &[f64], order: usize, left: impl Fn(usize) -> f64) -> f64 {
    let n = sh::count(order);
    let expected = |e: usize| if e / n == e % n { left(sh::degree(e / n)) } else { 0.0 };
    products.iter().enumerate().map(|(e, found)| (found - expected(e)).abs()).fold(0.0, f64::max)
}

/// Light that is in the harmonics is found again on any cube with texels enough, to rounding; an integral over its
/// texels finds it up to their width.
#[test]
fn least_squares_find_light_that_is_in_the_harmonics() {
    for (order, face, least) in [(2, 3, 0.01), (2, 16, 0.0005), (4, 4, 0.02), (4, 16, 0.0005)] {
        let fitted = off(&products(order, face, "least_squares=true"), order, |_| 1.0);
        let summed = off(&products(order, face, ""), order, |_| 1.0);
        println!("order {order}, {face} texels a face: {fitted:.1e}, by integration {summed:.1e}");
        assert!(fitted < 5e-6, "order {order}, {face} texels a face: off by {fitted:.1e}");
        assert!(summed > least, "order {order}, {face} texels a face: integration is off by {summed:.1e} only");
    }
}

/// Two by two texels a face hold 24 numbers, fewer than the 25 coefficients of order 4: what they don't tell apart is
/// left out, and nothing overflows.
#[test]
fn functions_that_texels_do_not_tell_apart_are_left_out() {
    let n = sh::count(4);
    let products = products(4, 2, "least_squares=true");
    let trace: f64 = (0..n).map(|k| products[k * n + k]).sum();
    assert!(products.iter().all(|x| x.abs() < 10.0), "{products:?}");
    assert!(trace < 24.01, "{trace} functions are told apart by 24 texels");
}

#[test]
fn windows_take_their_share_of_each_degree() {
    let hann = |l: usize| 0.5 + 0.5 * (PI * l as f64 / 4.0).cos();
    let lanczos = |l: usize| if l == 0 { 1.0 } else { (PI * l as f64 / 4.0).sin() / (PI * l as f64 / 4.0) };
    let damped = |window: u32| products(3, 8, &format!("least_squares=true deringing={window}"));
    assert!(off(&damped(0), 3, |_| 1.0) < 5e-6);
    assert!(off(&damped(1), 3, hann) < 5e-6);
    assert!(off(&damped(2), 3, lanczos) < 5e-6);
}

//! White furnaces: a ball of every kind of material under a uniform sky of radiance 1 shows what its model reflects and
//! lets through, by integrals of the model as glTF prints it.

use crate::device::gpu;
use crate::lobes::sphere;
use crate::support::repository;
use glam::{DVec3, Vec3, Vec4};
use lightgraph::internals::scene::{AddedCamera, Additions, Alpha, Coat, Face, Material};
use lightgraph::{Project, Scene, Session, Settings};
use std::f64::consts::PI;
use std::sync::Arc;

/// Where the camera stands before the ball, whose radius is 1, and the cosines under which it looks at it.
const AWAY: f64 = 4.0;
const COSINES: [f64; 2] = [1.0, 0.5];

/// What a rough surface seen under a cosine reflects of even light: all facets reflecting all of it; as much as
/// Schlick's (1 - cos)^5; and of a matte surface as much as that (glTF 2.0, appendix B.3).
fn reflected(cosine: f64, roughness: f64) -> [f64; 3] {
    let square = roughness.powi(4);
    let shadowing = |c: f64| 2.0 / (1.0 + (1.0 + square * (1.0 / (c * c) - 1.0)).sqrt());
    let view = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let mut sums = [0.0; 3];
    for (d, area) in sphere().filter(|(d, _)| d.z > 0.0) {
        let half = (d + view).normalize();
        let facets = square / (PI * (half.z * half.z * (square - 1.0) + 1.0).powi(2));
        let lobe = facets * shadowing(d.z) * shadowing(cosine) / (4.0 * cosine);
        let edge = (1.0 - half.dot(d)).powi(5);
        for (sum, term) in sums.iter_mut().zip([lobe, lobe * edge, edge * d.z / PI]) {
            *sum += area * term;
        }
    }
    sums
}

/// What of even light leaves a material towards who sees it under a cosine. With `dielectrics` every face reflects,
/// stated or not.
fn expected(m: &Material, cosine: f64, dielectrics: bool) -> DVec3 {
    let color = m.base_color.truncate().as_dvec3();
    if m.unlit {
        return color;
    }
    let metallic = f64::from(m.metallic);
    let strength = if dielectrics || m.is_faced() { f64::from(m.face.strength) } else { 0.0 };
    let head_on = ((f64::from(m.face.ior) - 1.0) / (f64::from(m.face.ior) + 1.0)).powi(2);
    let face = (head_on * m.face.tint.as_dvec3()).min(DVec3::ONE) * strength;
    let most = face.max_element();
    let lost = (strength - most) / (1.0 - most);
    let clear = f64::from(m.transmission);
    let matte = (1.0 - most) * (1.0 - metallic) * (1.0 - clear) * color;
    let tint = face.lerp(color, metallic);
    let edge = DVec3::splat(strength.max(metallic)) - tint;
    let [all, schlick, matte_schlick] = reflected(cosine, f64::from(m.roughness));
    let mut light = matte + tint * all + edge * schlick - lost * matte * matte_schlick;
    let grazing = (1.0 - cosine).powi(5);
    let coat = f64::from(m.coat.strength) * (0.04 + 0.96 * grazing);
    if coat > 0.0 {
        light = (1.0 - coat) * light + DVec3::splat(coat * reflected(cosine, f64::from(m.coat.roughness))[0]);
    }
    // Behind it there is the same light.
    let kept = 1.0 - (most + (strength - most) * grazing);
    light += clear * (1.0 - metallic) * kept * color + m.emission.as_dvec3();
    if m.alpha == Alpha::Blend {
        let there = f64::from(m.base_color.w);
        light = there * light + DVec3::splat(1.0 - there);
    }
    light
}

fn materials(plain: &Material) -> Vec<(&'static str, Material)> {
    let of = |name, change: fn(&mut Material)| {
        let mut m = plain.clone();
        m.base_color = Vec4::new(0.8, 0.5, 0.2, 1.0);
        change(&mut m);
        (name, m)
    };
    vec![
        of("matte", |_| {}),
        of("dielectric, smooth", |m| m.roughness = 0.4),
        of("half a metal", |m| (m.metallic, m.roughness) = (0.5, 0.6)),
        of("metal, roughness 0.4", |m| (m.metallic, m.roughness) = (1.0, 0.4)),
        of("metal, roughness 1", |m| m.metallic = 1.0),
        of("glowing", |m| m.emission = Vec3::new(0.5, 1.0, 2.0)),
        of("unlit", |m| m.unlit = true),
        of("ior 1.9", |m| (m.face.ior, m.roughness) = (1.9, 0.5)),
        of("tinted face", |m| m.face = Face { strength: 0.5, tint: Vec3::new(1.0, 0.6, 0.2), ..m.face }),
        of("thin glass", |m| (m.transmission, m.roughness) = (0.7, 0.5)),
        of("coated", |m| m.coat = Coat { strength: 0.8, roughness: 0.4, ..Coat::default() }),
        of("blended", |m| (m.alpha, m.base_color.w) = (Alpha::Blend, 0.3)),
    ]
}

/// The ball, looked at where its normal and the ray enclose these cosines, with its material in place of the first.
fn ball(materials: &[(&str, Material)], number: usize) -> Scene {
    let cameras = COSINES.iter().map(|cosine| {
        let sine = (1.0 - cosine * cosine).sqrt();
        let place = DVec3::new(sine, 0.0, *cosine);
        // From there on, so that the angle is the same for every distance.
        let at = (place + DVec3::Z * AWAY).as_vec3().to_array();
        (format!("{cosine}"), AddedCamera { at, look_at: Some(place.as_vec3().to_array()), fov: 0.2 })
    });
    let additions = Additions { cameras: cameras.collect(), ..Additions::default() };
    let loaded = Scene::load_with(&repository("scenes/sky_ball.ron"), &additions).unwrap_or_else(|f| panic!("{f}"));
    let mut scene = loaded.scene;
    scene.materials = materials.iter().map(|(_, m)| m.clone()).collect();
    scene.materials.swap(0, number);
    scene
}

/// Holds every material to 0.2 % of what even light leaves of it: nothing is lost, nothing is added. `edge`: pixels
/// along the image, of which the mean is taken.
fn holds(graph: &str, edge: u32, sets: &[&str], all: &[(&'static str, Material)]) {
    let gpu = gpu();
    let project = Project::open(&repository(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    let sets: Vec<String> = sets.iter().map(|set| (*set).into()).collect();
    let mut session: Option<Session> = None;
    let mut faults = vec![];
    for (number, (name, material)) in all.iter().enumerate() {
        let scene = Arc::new(ball(all, number));
        for cosine in COSINES {
            let settings = Settings {
                params: project.params(&sets).unwrap_or_else(|f| panic!("{f}")),
                size: [edge, edge],
                camera: Some(format!("{cosine}")),
                outputs: Some(vec!["color".into()]),
                ..Settings::default()
            };
            let next = Session::after(&gpu, &project, scene.clone(), settings, session.as_ref());
            let session = session.insert(next.unwrap_or_else(|f| panic!("{f}")));
            session.frame(&gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
            let image = session.image(&gpu, "color").unwrap_or_else(|f| panic!("{f}"));
            let sum: DVec3 = image.rgb().map(|p| Vec3::from(p).as_dvec3()).sum();
            let found = sum / f64::from(edge * edge);
            let expected = expected(material, cosine, sets.iter().any(|set| set == "dielectrics=true"));
            let off = (found / expected - 1.0).abs().max_element();
            println!("{name}, cosine {cosine}: {found:.4}, integrated {expected:.4}, off by {:.3} %", 100.0 * off);
            if off > 0.002 {
                faults.push(format!("{name}, cosine {cosine}: {found}, not {expected} ({:.3} %)", 100.0 * off));
            }
        }
    }
    assert!(faults.is_empty(), "{graph}:\n{}", faults.join("\n"));
}

fn plain() -> Material {
    let scene = Scene::load(&repository("scenes/sky_ball.ron")).unwrap_or_else(|f| panic!("{f}")).scene;
    scene.materials[0].clone()
}

#[test]
fn every_material_shows_its_albedo_under_a_uniform_sky() {
    holds("graphs/gi/pathtrace.ron", 8, &["samples=1024"], &materials(&plain()));
}

/// Those without a metal, all of whose faces reflect; also beside a material that states what its face does.
fn dielectrics() -> Vec<(&'static str, Material)> {
    let mut all = materials(&plain());
    all.retain(|(name, _)| ["matte", "dielectric, smooth", "ior 1.9"].contains(name));
    all
}

#[test]
fn dielectrics_reflect_at_their_face_where_that_is_asked_for() {
    holds("graphs/gi/pathtrace.ron", 8, &["samples=1024", "dielectrics=true"], &dielectrics());
}

#[test]
fn dielectrics_reflect_at_their_face_in_the_final_gather() {
    holds("graphs/gi/final_gather.ron", 32, &["environment_samples=256", "dielectrics=true"], &dielectrics());
}

/// Those that light does not pass.
fn opaque() -> Vec<(&'static str, Material)> {
    let mut all = materials(&plain());
    all.retain(|(_, m)| m.transmission == 0.0 && m.alpha != Alpha::Blend);
    all
}

#[test]
fn direct_light_shows_each_opaque_albedo_under_a_uniform_sky() {
    let mut all = opaque();
    all.retain(|(_, m)| !m.is_faced() && m.coat.strength == 0.0);
    holds("graphs/gi/direct.ron", 8, &["environment_samples=256"], &all);
}

#[test]
fn the_final_gather_shows_each_opaque_albedo_under_a_uniform_sky() {
    holds("graphs/gi/final_gather.ron", 32, &["environment_samples=256"], &opaque());
}

//! A steady frame: what the executor allocates doesn't grow with the passes, beyond what wgpu does for any program.

use crate::device;
use crate::support::repository;
use lightgraph::internals::gpu::{FrameInputs, Prepared, execute, prepare};
use lightgraph::internals::session::plan_for;
use lightgraph::internals::value::Value;
use lightgraph::{Gpu, Plan, Project, Scene, Settings};
use lightgraph_cli::bench::speed::Handwritten;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, and how often each thread asks it.
struct Counting;

thread_local! {
    static ASKED: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // A thread that ends may have dropped its count already.
    let _ = ASKED.try_with(|n| n.set(n.get() + 1));
}

// Safety: all is left to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, ptr: *mut u8, layout: Layout) {
        unsafe { System.dealloc(ptr, layout) }
    }

    unsafe fn realloc(&self, ptr: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        unsafe { System.realloc(ptr, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Allocations of this thread in the course of some work.
fn allocations<T>(work: impl FnOnce() -> T) -> u64 {
    let before = ASKED.get();
    drop(work());
    ASKED.get() - before
}

/// The least of a few frames: wgpu tidies up in some of them.
fn least(mut frame: impl FnMut()) -> u64 {
    frame();
    (0..5).map(|_| allocations(&mut frame)).min().unwrap_or(0)
}

fn planned(gpu: &Gpu, scene: &Scene, passes: u32) -> Plan {
    let project = Project::open(&repository("benches/chain.ron"), &[]).unwrap_or_else(|f| panic!("{f}"));
    let params = project.params(&[format!("passes={passes}")]).unwrap_or_else(|f| panic!("{f}"));
    let settings = Settings { params, size: [8, 8], ..Settings::default() };
    plan_for(&project, scene, &settings, gpu).unwrap_or_else(|f| panic!("{f}")).plan
}

/// Allocations of a frame by the executor and by the program that was written by hand.
fn frames(gpu: &Gpu, scene: &Scene, passes: u32) -> [u64; 2] {
    let plan = planned(gpu, scene, passes);
    let pose = scene.pose(0.0);
    let prepared = prepare(gpu, &plan, &scene.assets(), &scene.tables(&pose));
    let mut prepared: Prepared = prepared.unwrap_or_else(|f| panic!("{f}"));
    let mut values = scene.camera_values(&pose, None, 8, 8).unwrap_or_else(|f| panic!("{f}")).0;
    values.insert("frame".into(), Value::Uint(0));
    values.insert("first_frame".into(), Value::Bool(true));
    values.insert("time".into(), Value::Float(0.0));
    let frame = FrameInputs { values, ..FrameInputs::default() };
    let executor = least(|| drop(execute(gpu, &plan, &mut prepared, &frame).unwrap_or_else(|f| panic!("{f}"))));
    let program = Handwritten::new(gpu, &plan).unwrap_or_else(|| panic!("it was written for another chain"));
    [executor, least(|| program.frame(gpu).unwrap_or_else(|f| panic!("{f}")))]
}

#[test]
fn a_pass_more_is_no_allocation_more() {
    let gpu = &device::gpu();
    let scene = Scene::load(&repository("scenes/lambert_plane.glb")).unwrap_or_else(|f| panic!("{f}")).scene;
    let ([few, few_by_hand], [many, many_by_hand]) = (frames(gpu, &scene, 100), frames(gpu, &scene, 500));
    let growth = |few: u64, many: u64| many.saturating_sub(few) as f64 / 400.0;
    let (ours, by_hand) = (growth(few, many), growth(few_by_hand, many_by_hand));
    println!("a frame of 100 passes: {few} allocations, {few_by_hand} by hand; a pass more: {ours}, {by_hand} by hand");
    // What each pass did would show as one more. The rest are lists that double as they fill, ours and wgpu's, and
    // wgpu's records of timestamps, which the other program doesn't take.
    assert!(ours < by_hand + 0.5, "a pass allocates {ours} times, {by_hand} times by hand");
}

//! The public types as other programs use them.

use lightgraph::internals::diag::Source;
use lightgraph::internals::gpu::Prepared;
use lightgraph::internals::shader::{Library, Shader};
use lightgraph::{Diagnostic, Faults, FrameReport, Gpu, Graph, Image, Plan, Project, Scene, Session, Settings};

fn send<T: Send>() {}
fn shared<T: Send + Sync>() {}

/// It compiles: everything can go to another thread, and what does not change can be shared, as with wgpu itself.
#[test]
fn types_cross_threads_as_those_of_wgpu_do() {
    shared::<wgpu::Device>();
    shared::<Gpu>();
    shared::<Graph>();
    shared::<Plan>();
    shared::<Scene>();
    shared::<Library>();
    shared::<Shader>();
    shared::<Project>();
    shared::<Settings>();
    shared::<Image>();
    shared::<Source>();
    shared::<Diagnostic>();
    shared::<Faults>();
    shared::<FrameReport>();
    send::<Prepared>();
    send::<Session>();
}

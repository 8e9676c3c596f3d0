//! Matches the vertex inputs and colour outputs of a draw or screen pass with the scene and its targets, and adds the
//! resolves of multisampled targets.

use super::wire::{How, Mode, ResourceUse, Wired, Wirer, by_name};
use super::{Desc, TextureDesc, TextureKind, request};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{Name, Pass, PassKind, Raster, ResourceDecl};
use crate::graph::expr::Expr;
use crate::shader::{Output, OutputKind, Shader, Stage};
use std::collections::BTreeSet;
use wgpu_types::TextureFormatFeatureFlags as Flags;

impl<'g> Wirer<'g, '_> {
    /// Checks that the scene has each attribute that a vertex entry takes.
    pub(super) fn vertex_inputs(&mut self, pass: &Pass, shader: &Shader) {
        let Some(entry) = shader.interface.entry(Stage::Vertex) else { return };
        let known = crate::scene::VERTEX_ATTRIBUTES;
        if let PassKind::Draw(Raster { vertices: Some(own), .. }) = &pass.kind {
            for input in &entry.inputs {
                let d = Diagnostic::error(format!("a draw without the scene has no attribute `{}`", input.name));
                let d = d.at(&self.locate(pass, shader, &input.name), "").at(&own.count.span, "");
                self.faults.push(d.help("make the vertex up from `@builtin(vertex_index)` and `instance_index`"));
            }
            return;
        }
        for input in &entry.inputs {
            match known.iter().find(|a| a.0 == input.name) {
                None => {
                    let d = Diagnostic::error(format!("vertices have no attribute `{}`", input.name));
                    let d = d.at(&self.locate(pass, shader, &input.name), "");
                    self.faults.push(d.nearest(&input.name, known.map(|a| a.0)));
                }
                Some(a) if a.1 != input.format => {
                    let d = Diagnostic::error(format!("the attribute `{}` is {:?}, not {:?}", a.0, a.1, input.format));
                    let d = d.at(&self.locate(pass, shader, &input.name), "");
                    self.faults.push(d);
                }
                Some(_) => {}
            }
        }
    }

    /// The targets of a fragment entry's outputs, and of depth.
    pub(super) fn targets(&mut self, wired: &mut Wired<'g>, r: &'g Raster, shader: &Shader) {
        let outputs: &[Output] = shader.interface.entry(Stage::Fragment).map_or(&[], |e| &e.outputs);
        for o in outputs {
            let (resource, span) = match (&o.name, &r.color) {
                (Some(n), _) => match wired.pass.target(n) {
                    (to, Some(said)) => (to, said.span.clone()),
                    (to, None) => (to, self.locate(wired.pass, shader, n)),
                },
                (None, Some(c)) => (c.value.clone(), c.span.clone()),
                (None, None) => {
                    let d = Diagnostic::error("the fragment shader returns a value without a name");
                    self.faults.push(d.at(&r.shader.span, "").help("say where it goes: `color: \"name\"`"));
                    continue;
                }
            };
            if let (Some(_), Some(c)) = (&o.name, &r.color) {
                let d = Diagnostic::error("`color` is for a fragment shader that returns a bare value");
                self.faults.push(d.at(&c.span, "this one's outputs have names").help("use `bind` to rename them"));
            }
            let Some(declared) = self.sizes.declared(&resource) else {
                let d =
                    Diagnostic::error(format!("nothing is called `{resource}`: the fragment's output has no target"));
                let names = self.graph().resources.iter().map(|(n, _)| n.value.as_str());
                self.faults.push(d.at(&span, "").nearest(&resource, names));
                continue;
            };
            let Some(sized) = self.sizes.of(&resource).and_then(|s| self.keep(s)) else { continue };
            if let Desc::Texture(t) = &sized.desc {
                self.output_fits(o, &resource, t.format, &span, &declared.span);
            } else {
                let d = Diagnostic::error(format!("`{resource}` is a buffer, it can't be a colour target"));
                self.faults.push(d.at(&span, "").at(&declared.span, "declared here"));
                continue;
            }
            let variable = o.name.as_deref().unwrap_or_default();
            let Some(said) = self.mip(wired.pass, variable, &resource, &sized.desc) else { continue };
            let several = matches!(&sized.desc, Desc::Texture(t) if t.mips > 1);
            let mip = several.then_some(said.unwrap_or(0));
            let mode = self.target_mode(wired, r, &resource);
            // What is kept is read because the pass says so, not the shader.
            let span = r.load.iter().find(|n| n.value == resource).map_or(span, |n| n.span.clone());
            wired.color.push((o.location, resource.clone(), mip.unwrap_or(0)));
            wired.uses.push(ResourceUse { resource, mip, mode, how: How::Target, span });
        }
        wired.color.sort();
        self.resolves(wired, r);
        if let Some(depth) = &r.depth {
            let mode = if r.depth_write { self.target_mode(wired, r, &depth.value) } else { Mode::Read };
            let several =
                matches!(self.sizes.of(&depth.value), Some(Ok(s)) if matches!(&s.desc, Desc::Texture(t) if t.mips > 1));
            wired.uses.push(ResourceUse { mip: several.then_some(0), ..by_name(depth, mode, How::Target) });
        } else if shader.interface.entry(Stage::Fragment).is_some_and(|e| e.writes_depth) {
            let d = Diagnostic::error("the shader writes depth, but the pass has no depth target");
            self.faults.push(d.at(&r.shader.span, "").help("add `depth: \"name\"`"));
        }
        if outputs.is_empty() && r.depth.is_none() {
            let d = Diagnostic::error("the pass has neither a colour output nor a depth target");
            self.faults.push(d.at(&wired.pass.name.span, ""));
        }
        for (name, _) in &r.blend {
            self.blends(wired, name);
        }
        let named: BTreeSet<&str> =
            wired.uses.iter().filter(|u| u.how == How::Target).map(|u| u.resource.as_str()).collect();
        let strays = r.load.iter().chain(r.clear.iter().map(|c| &c.0)).filter(|n| !named.contains(n.value.as_str()));
        let strays: Vec<Diagnostic> = strays
            .map(|n| {
                let d = Diagnostic::error(format!("`{}` is not a target of this pass", n.value)).at(&n.span, "");
                d.nearest(&n.value, named.iter().copied())
            })
            .collect();
        self.faults.extend(strays);
    }

    /// Only colours are blended, of formats that can be.
    fn blends(&mut self, wired: &Wired, name: &Name) {
        let Some(Ok(sized)) = self.sizes.of(&name.value) else { return };
        let Desc::Texture(t) = &sized.desc else { return };
        if !wired.color.iter().any(|(_, color, _)| *color == name.value) {
            let d = Diagnostic::error(format!("`{}` is no colour target of this pass", name.value)).at(&name.span, "");
            self.faults.push(d.nearest(&name.value, wired.color.iter().map(|c| c.1.as_str())));
            return;
        }
        let features = t.format.guaranteed_format_features(self.request.features);
        if !features.flags.contains(wgpu_types::TextureFormatFeatureFlags::BLENDABLE) {
            let d = Diagnostic::error(format!("{:?} can't be blended on this adapter", t.format)).at(&name.span, "");
            self.faults.push(d.help("take a format of 8 or 16 bits that is no integer: `Rgba16Float`"));
        }
    }

    /// A target is overwritten whole, unless it is loaded or only some of its layers are drawn to.
    fn target_mode(&self, wired: &Wired, r: &Raster, resource: &str) -> Mode {
        if r.load.iter().any(|n| n.value == resource) {
            return Mode::ReadWrite;
        }
        let layers = match self.sizes.of(resource) {
            Some(Ok(s)) => match &s.desc {
                Desc::Texture(t) if t.tiles.is_none() && s.members.is_none() => t.layers,
                _ => 1,
            },
            _ => 1,
        };
        let views =
            r.views.as_ref().and_then(|v| request::count(v, self.values, "a number of views").ok()).unwrap_or(1);
        let drawn = if r.layer.is_some() { 1 } else { wired.each.unwrap_or(1).saturating_mul(views) };
        if layers > drawn { Mode::Partial } else { Mode::Write }
    }

    fn output_fits(&mut self, o: &Output, name: &str, format: wgpu_types::TextureFormat, span: &Span, declared: &Span) {
        let kind = match format.sample_type(None, Some(wgpu_types::Features::FLOAT32_FILTERABLE)) {
            Some(wgpu_types::TextureSampleType::Float { .. }) => OutputKind::Float,
            Some(wgpu_types::TextureSampleType::Uint) => OutputKind::Uint,
            Some(wgpu_types::TextureSampleType::Sint) => OutputKind::Sint,
            _ => {
                let d = Diagnostic::error(format!("`{name}` is {format:?}, not a colour format")).at(span, "");
                self.faults.push(d.at(declared, "declared here"));
                return;
            }
        };
        let features = format.guaranteed_format_features(self.request.features);
        if !features.allowed_usages.contains(wgpu_types::TextureUsages::RENDER_ATTACHMENT) {
            let d = Diagnostic::error(format!("{format:?} can't be drawn to on this adapter")).at(span, "");
            self.faults.push(d.at(declared, "declared here"));
        } else if kind != o.kind || format.components() > o.components {
            let wants = format!("{:?} with {} components", kind, format.components());
            let has = format!("{:?} with {}", o.kind, o.components);
            let d = Diagnostic::error(format!("`{name}` is {format:?}: it takes {wants}, the shader gives {has}"));
            self.faults.push(d.at(span, "").at(declared, "declared here"));
        }
    }
}

/// A texture with so many samples a texel.
///
/// # Errors
/// Samples that the adapter lacks for the format; layers, levels, history and initial content.
pub(super) fn sampled(
    name: &str,
    declared: &ResourceDecl,
    t: TextureDesc,
    (samples, said): (u32, &Expr),
    features: wgpu_types::Features,
) -> Result<TextureDesc, Diagnostic> {
    if samples == 1 {
        return Ok(t);
    }
    let flags = t.format.guaranteed_format_features(features).flags;
    if !flags.sample_count_supported(samples) {
        let d = Diagnostic::error(format!("`{name}` can't have {samples} samples a texel as {:?}", t.format));
        let all: Vec<String> = flags.supported_sample_counts().iter().map(u32::to_string).collect();
        return Err(d.at(&said.span, "").help(format!("this adapter has {}", all.join(", "))));
    }
    let plain = t.kind == (TextureKind::D2 { array: false }) && t.mips == 1;
    if !plain || declared.history || declared.initial.is_some() {
        let d = Diagnostic::error(format!("`{name}` has several samples a texel, and more than one level or layer"));
        let d = if plain { Diagnostic::error(format!("`{name}` has several samples a texel, and is kept")) } else { d };
        let help = "resolve it: what the samples resolve to may have levels, and be kept";
        return Err(d.at(&said.span, "").at(&declared.span, "declared here").help(help));
    }
    Ok(TextureDesc { samples, ..t })
}

impl<'g> Wirer<'g, '_> {
    fn samples(&self, resource: &str) -> u32 {
        match self.sizes.of(resource) {
            Some(Ok(sized)) => match sized.desc {
                Desc::Texture(t) => t.samples,
                Desc::Buffer { .. } => 1,
            },
            _ => 1,
        }
    }

    /// What the targets of a pass resolve to.
    pub(super) fn resolves(&mut self, wired: &mut Wired<'g>, r: &'g Raster) {
        for (from, to) in &r.resolve {
            if matches!(self.sizes.of(&from.value), Some(Err(_))) {
                continue;
            }
            let Some((location, ..)) = wired.color.iter().find(|(_, color, _)| *color == from.value) else {
                let d = Diagnostic::error(format!("`{}` is no colour target of this pass", from.value));
                let colors = wired.color.iter().map(|c| c.1.as_str());
                self.faults.push(d.at(&from.span, "").nearest(&from.value, colors));
                continue;
            };
            if !self.resolvable(from, to) {
                continue;
            }
            let location = *location;
            if self.samples(&from.value) > 1 {
                wired.resolve.push((location, to.value.clone()));
                wired.uses.push(by_name(to, Mode::Write, How::Target));
            } else {
                // Of one sample the mean is a copy.
                wired.copies.push((from, to));
                wired.uses.push(by_name(to, Mode::Write, How::CopyTarget));
            }
        }
    }

    fn resolvable(&mut self, from: &Name, to: &Name) -> bool {
        let (Some(Ok(a)), Some(Ok(b))) = (self.sizes.of(&from.value), self.sizes.of(&to.value)) else { return false };
        let (Desc::Texture(a), Desc::Texture(b)) = (a.desc, b.desc) else { return false };
        let fault = |text: String| Diagnostic::error(text).at(&from.span, "").at(&to.span, "");
        let d = if b.samples > 1 || b.mips > 1 || b.kind != a.kind {
            fault(format!("`{}` can't take the mean of samples", to.value))
                .help("resolve to a `Texture` of one sample, without levels and layers")
        } else if (a.format, a.width, a.height) != (b.format, b.width, b.height) {
            let text = |t: &TextureDesc| format!("{:?} {}×{}", t.format, t.width, t.height);
            fault(format!("`{}` is {}, `{}` {}", from.value, text(&a), to.value, text(&b)))
                .help("give both one format and size")
        } else if a.samples > 1 && !self.has_mean(a.format) {
            fault(format!("samples of {:?} have no mean on this adapter", a.format))
                .help("take a format of 8 or 16 bits that is no integer: `Rgba16Float`")
        } else {
            return true;
        };
        self.faults.push(d);
        false
    }

    fn has_mean(&self, format: wgpu_types::TextureFormat) -> bool {
        format.guaranteed_format_features(self.request.features).flags.contains(Flags::MULTISAMPLE_RESOLVE)
    }

    /// Several samples a texel are for targets, all of a pass with as many.
    pub(super) fn samples_fit(&mut self, wired: &Wired) {
        // A size may be asked for.
        let many = |u: &&ResourceUse| u.mode != Mode::Size && self.samples(&u.resource) > 1;
        let strays: Vec<ResourceUse> =
            wired.uses.iter().filter(|u| u.how != How::Target).filter(many).cloned().collect();
        for u in strays {
            let d = Diagnostic::error(format!("`{}` has several samples a texel: passes only draw to it", u.resource));
            let d = d.at(&u.span, "").at(&wired.pass.name.span, "in this pass");
            self.faults.push(d.help(format!("resolve it: `resolve: {{\"{}\": \"…\"}}`, and take that", u.resource)));
        }
        let resolved = |name: &str| wired.resolve.iter().any(|(_, to)| to == name);
        let mut targets = wired.uses.iter().filter(|u| u.how == How::Target && !resolved(&u.resource));
        let Some(first) = targets.next() else { return };
        let samples = self.samples(&first.resource);
        if let Some(other) = targets.find(|u| self.samples(&u.resource) != samples) {
            let d = Diagnostic::error(format!(
                "the targets `{}` and `{}` differ in samples a texel: {samples} and {}",
                first.resource,
                other.resource,
                self.samples(&other.resource)
            ));
            let d = d.at(&other.span, "").at(&first.span, "");
            self.faults.push(d.help("give all targets of a pass as many `samples`"));
        }
    }
}

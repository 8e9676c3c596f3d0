//! Targets of several samples a texel, and what they resolve to.

use super::wire::{How, Mode, ResourceUse, Wired, Wirer, by_name};
use super::{Desc, TextureDesc, TextureKind};
use crate::diag::Diagnostic;
use crate::graph::ast::{Name, Raster, Resource};
use crate::graph::expr::Expr;
use wgpu_types::TextureFormatFeatureFlags as Flags;

/// A texture with so many samples a texel.
///
/// # Errors
/// Samples that the adapter lacks for the format; layers, levels, history and initial content.
pub(super) fn sampled(
    name: &str,
    declared: &Resource,
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

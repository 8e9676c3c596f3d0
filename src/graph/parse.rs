//! The tree of a file to its [`Graph`]: shapes, keys and literals. Gathers every fault.

use super::ast::SamplerDesc;
use super::ast::{Dirty, Graph, Input, Name, Param, Pass, PassKind, ResourceDecl, ResourceKind, Size, Stride, Warning};
use super::expr::Expr;
use super::join::look_around;
use super::param::parse_vector;
use super::read::{Fields, Reader};
use super::tree::{SyntaxKind, SyntaxNode};
use crate::diag::{Diagnostic, Span, nearest};
use crate::value::{Type, Value};
use glam::{UVec2, UVec3, Vec2, Vec3, Vec4};
use std::sync::LazyLock;

impl Reader {
    /// A whole graph.
    pub fn graph(&mut self, fields: &mut Fields, span: &Span) -> Graph {
        let about = fields.get("about").and_then(|n| self.prose(n)).unwrap_or_default();
        let outer = std::mem::take(&mut self.joined);
        let inputs = self.declared(fields.get("inputs"), Reader::input);
        let params = self.declared(fields.get("params"), Reader::param);
        let lets = self.declared(fields.get("lets"), Reader::expr);
        let defines = self.declared(fields.get("defines"), Reader::expr);
        let resources = self.declared(fields.get("resources"), Reader::resource);
        let passes = self.need(fields, "passes");
        let passes = self.passes(passes);
        let outputs = self.need(fields, "outputs");
        let outputs = self.declared(outputs, Reader::name);
        let warnings = self.declared(fields.get("warnings"), Reader::warning);
        self.finish(fields);
        let source = span.source.clone();
        let (files, images) = (vec![], vec![]);
        let mut graph =
            Graph { source, files, images, about, inputs, params, lets, defines, resources, passes, outputs, warnings };
        let mut joined = std::mem::replace(&mut self.joined, outer);
        joined.iter_mut().for_each(|j| j.declare(&mut graph));
        joined.iter().for_each(|j| j.check(&joined, self, &graph));
        joined.iter().for_each(|j| j.name_outputs(&mut graph));
        look_around(&mut graph);
        graph
    }

    /// The passes of a list; those of a sub-graph in place of the pass that uses it.
    pub(super) fn passes(&mut self, node: Option<&SyntaxNode>) -> Vec<Pass> {
        let mut passes = vec![];
        for node in self.list(node) {
            match &node.kind {
                SyntaxKind::Struct(Some(word), _) if word.text() == "Use" => passes.extend(self.sub_graph(node)),
                _ => passes.extend(self.pass(node)),
            }
        }
        passes
    }

    /// `Float(default: …, min: …, max: …, about: "…")` and the like.
    pub fn param(&mut self, node: &SyntaxNode) -> Option<Param> {
        let (name, fields) = self.named(node, &VALUES.map(|k| k.0))?;
        self.param_of(node, name, fields, false)
    }

    /// `blank`: without a default it is 0, or false.
    fn param_of(&mut self, node: &SyntaxNode, name: &str, mut fields: Fields, blank: bool) -> Option<Param> {
        let zero = VALUES.iter().find(|k| k.0 == name)?.1;
        let ty = zero.ty();
        let place = if blank { fields.get("default") } else { self.need(&mut fields, "default") };
        let default = match place {
            None if blank => Some(zero),
            place => place.and_then(|n| self.value(n, ty)),
        };
        let min = fields.get("min").and_then(|n| self.value(n, ty));
        let max = fields.get("max").and_then(|n| self.value(n, ty));
        let about = fields.get("about").and_then(|n| self.prose(n)).unwrap_or_default();
        self.finish(&fields);
        let param = Param { ty, default: default?, min, max, about, span: node.span.clone() };
        if let Err(why) = param.accepts(&param.default) {
            let place = place.unwrap_or(node);
            self.fault(Diagnostic::error(format!("the default is {why}")).at(&place.span, ""));
        }
        Some(param)
    }

    /// `Warning(when: "…", about: "…")`.
    fn warning(&mut self, node: &SyntaxNode) -> Option<Warning> {
        let (_, mut fields) = self.named(node, &["Warning"])?;
        let when = self.need(&mut fields, "when").and_then(|n| self.expr(n));
        let about = self.need(&mut fields, "about").and_then(|n| self.prose(n));
        self.finish(&fields);
        Some(Warning { when: when?, about: about? })
    }

    /// A literal of a type.
    pub fn value(&mut self, node: &SyntaxNode, ty: Type) -> Option<Value> {
        let value = match (&node.kind, ty) {
            (SyntaxKind::Word, Type::Bool) => node.span.text().parse().ok().map(Value::Bool),
            (SyntaxKind::Word, Type::Uint) => node.span.text().parse().ok().map(Value::Uint),
            (SyntaxKind::Word, Type::Int) => node.span.text().parse().ok().map(Value::Int),
            (SyntaxKind::Word, Type::Float) => {
                node.span.text().parse::<f32>().ok().filter(|x| x.is_finite()).map(Value::Float)
            }
            (SyntaxKind::Tuple(None, items), _) => {
                let words: Vec<&str> = items.iter().map(|n| n.span.text()).collect();
                parse_vector(&words, ty)
            }
            _ => None,
        };
        if value.is_none() {
            self.fault(Diagnostic::error(format!("expected a value of type {}", ty.wgsl())).at(&node.span, ""));
        }
        value
    }

    pub(super) fn format(&mut self, node: &SyntaxNode) -> Option<wgpu_types::TextureFormat> {
        let word = node.word().unwrap_or("");
        let found = FORMAT_NAMES.iter().position(|name| name == word).map(|i| FORMATS[i]);
        if found.is_none() {
            let d = Diagnostic::error(format!("unknown texture format `{}`", node.span.text())).at(&node.span, "");
            let near = nearest(word, FORMAT_NAMES.iter().map(String::as_str));
            let d = match near {
                Some(n) => d.help(format!("did you mean `{n}`?")),
                None => d.help(format!("formats are {}", FORMAT_NAMES.join(", "))),
            };
            self.fault(d);
        }
        found
    }

    fn size(&mut self, node: &SyntaxNode) -> Option<Size> {
        match &node.kind {
            SyntaxKind::Tuple(None, items) if (1..=3).contains(&items.len()) => {
                let axes = items.iter().map(|n| self.expr(n)).collect::<Option<_>>()?;
                Some(Size::Axes(axes, node.span.clone()))
            }
            _ => self.expr(node).map(Size::One),
        }
    }

    /// A resource declaration.
    pub fn resource(&mut self, node: &SyntaxNode) -> Option<ResourceDecl> {
        const KINDS: [&str; 8] = ["Texture", "Texture3d", "Cube", "Atlas", "Buffer", "Image", "Table", "Sampler"];
        let (name, f) = self.named(node, &KINDS)?;
        match name {
            "Image" => self.image(node, f),
            "Table" => self.table(node, f),
            _ => self.resource_of(node, name, f, None),
        }
    }

    /// What a graph takes from outside: a resource or a value, of which only the kind must be said.
    fn input(&mut self, node: &SyntaxNode) -> Option<Input> {
        const RESOURCES: [&str; 5] = ["Texture", "Texture3d", "Cube", "Atlas", "Buffer"];
        let (name, f) = self.named(node, &[&RESOURCES[..], &VALUES.map(|k| k.0)].concat())?;
        if !RESOURCES.contains(&name) {
            return self.param_of(node, name, f, true).map(Input::Value);
        }
        let usual = if name == "Texture" { "screen" } else { "1" };
        let usual = Expr::parse(&Span::new(&node.span.source, node.span.start..node.span.start), usual).ok()?;
        let mut input = self.resource_of(node, name, f, Some(&usual))?;
        input.initial = input.initial.or(Some([0.0; 4]));
        Some(Input::Resource(input))
    }

    /// `usual`: a size or number in place of one that isn't said.
    fn resource_of(
        &mut self,
        node: &SyntaxNode,
        name: &str,
        mut f: Fields,
        usual: Option<&Expr>,
    ) -> Option<ResourceDecl> {
        let before = self.faults.len();
        let kind = if name == "Sampler" {
            let filter = [("Nearest", wgpu_types::FilterMode::Nearest), ("Linear", wgpu_types::FilterMode::Linear)];
            let address = [
                ("Clamp", wgpu_types::AddressMode::ClampToEdge),
                ("Repeat", wgpu_types::AddressMode::Repeat),
                ("Mirror", wgpu_types::AddressMode::MirrorRepeat),
            ];
            Some(ResourceKind::Sampler(SamplerDesc {
                filter: self.word(f.get("filter"), &filter, wgpu_types::FilterMode::Nearest),
                address: self.word(f.get("address"), &address, wgpu_types::AddressMode::ClampToEdge),
                compare: f.get("compare").map(|n| self.compare(Some(n), wgpu_types::CompareFunction::LessEqual)),
            }))
        } else if name == "Buffer" {
            let stride = self.stride(&mut f, usual.is_some());
            let count = self.number_of(&mut f, "count", usual);
            stride.zip(count).map(|(stride, count)| ResourceKind::Buffer { stride, count })
        } else {
            let format = match (usual, f.get("format")) {
                (_, Some(n)) => self.format(n),
                (Some(_), None) => Some(wgpu_types::TextureFormat::Rgba16Float),
                (None, None) => self.need(&mut f, "format").and(None),
            };
            if name == "Atlas" {
                let tile = self.number_of(&mut f, "tile", usual);
                let count = self.number_of(&mut f, "count", usual);
                format.zip(tile.zip(count)).map(|(format, (tile, count))| ResourceKind::Atlas { format, tile, count })
            } else {
                let size = match (usual, f.get("size")) {
                    (_, Some(n)) => self.size(n),
                    (Some(usual), None) => Some(Size::One(usual.clone())),
                    (None, None) => self.need(&mut f, "size").and(None),
                };
                let mips = f.get("mips").and_then(|n| self.expr(n));
                let many = match name {
                    "Texture" => f.get("layers"),
                    "Cube" => f.get("count"),
                    _ => None,
                };
                let many = many.and_then(|n| self.expr(n));
                let samples = if name == "Texture" { f.get("samples").and_then(|n| self.expr(n)) } else { None };
                format.zip(size).map(|(format, size)| match name {
                    "Texture" => ResourceKind::Texture { format, size, layers: many, mips, samples },
                    "Cube" => ResourceKind::Cube { format, size, count: many, mips },
                    _ => ResourceKind::Texture3d { format, size, mips },
                })
            }
        };
        let (mut history, mut initial, mut members, mut min, mut max) = (false, None, None, None, None);
        if name != "Sampler" {
            history = self.bool(f.get("history"), false);
            initial = f.get("initial").and_then(|n| self.color(n));
            members = f.get("members").and_then(|n| self.expr(n));
            min = f.get("min").and_then(|n| self.number(n));
            max = f.get("max").and_then(|n| self.number(n));
            if min.zip(max).is_some_and(|(min, max)| min > max) {
                self.fault(Diagnostic::error("its `min` exceeds its `max`").at(&node.span, ""));
            }
        }
        self.finish(&f);
        debug_assert!(kind.is_some() || self.faults.len() > before, "what can't be read is a fault");
        Some(ResourceDecl { span: node.span.clone(), kind: kind?, history, initial, members, min, max })
    }

    /// A buffer's `stride` in bytes, or the `element` that has it.
    fn stride(&mut self, f: &mut Fields, input: bool) -> Option<Stride> {
        match (f.get("stride"), f.get("element")) {
            (Some(bytes), None) => self.expr(bytes).map(Stride::Bytes),
            (None, Some(element)) => self.text(element).map(Stride::Of),
            (None, None) if input => Some(Stride::Any),
            (None, None) => {
                let d = Diagnostic::error("a buffer needs an `element` or a `stride`").at(f.span, "");
                self.fault(d.help("name the type of its elements, as the shaders do: `element: \"u32\"`"));
                None
            }
            (Some(bytes), Some(element)) => {
                let d = Diagnostic::error("an element has a stride of its own").at(&bytes.span, "");
                self.fault(d.at(&element.span, "").help("leave one of them out"));
                None
            }
        }
    }

    fn number_of(&mut self, f: &mut Fields, name: &'static str, usual: Option<&Expr>) -> Option<Expr> {
        match (usual, f.get(name)) {
            (_, Some(n)) => self.expr(n),
            (Some(usual), None) => Some(usual.clone()),
            (None, None) => self.need(f, name).and(None),
        }
    }

    pub(super) fn compare(
        &mut self,
        node: Option<&SyntaxNode>,
        default: wgpu_types::CompareFunction,
    ) -> wgpu_types::CompareFunction {
        use wgpu_types::CompareFunction as C;
        let choices = [
            ("Less", C::Less),
            ("LessEqual", C::LessEqual),
            ("Greater", C::Greater),
            ("GreaterEqual", C::GreaterEqual),
            ("Equal", C::Equal),
            ("NotEqual", C::NotEqual),
            ("Always", C::Always),
            ("Never", C::Never),
        ];
        self.word(node, &choices, default)
    }

    /// A pass, with those in it.
    pub fn pass(&mut self, node: &SyntaxNode) -> Option<Pass> {
        let before = self.faults.len();
        const KINDS: [&str; 12] =
            ["Draw", "Screen", "Compute", "Reduce", "Scan", "Copy", "Clear", "Mips", "Loop", "For", "Fastest", "Use"];
        let (word, mut f) = self.named(node, &KINDS)?;
        let name = self.need(&mut f, "name").and_then(|n| self.own_name(n));
        let when = f.get("when").and_then(|n| self.expr(n));
        let group = f.get("group").and_then(|n| self.text(n));
        let (mut each, mut only) = (None, None);
        let (mut defines, mut entry, mut set) = (vec![], vec![], vec![]);
        let (mut bind, mut mips) = (vec![], vec![]);
        let mut tune = None;
        if !matches!(word, "Mips" | "Loop" | "For" | "Fastest") {
            each = f.get("each").and_then(|n| self.expr(n));
        }
        if matches!(word, "Draw" | "Compute") {
            only = f.get("only").and_then(|n| self.dirty(n));
        }
        if matches!(word, "Draw" | "Screen" | "Compute" | "Reduce") {
            defines = self.exprs(f.get("defines"));
            entry = self.entries(f.get("entry"));
            (bind, mips) = self.bindings(f.get("bind"));
            set = self.exprs(f.get("set"));
            tune = f.get("tune");
        }
        let kind = self.pass_kind(word, &mut f);
        self.finish(&f);
        if self.faults.len() > before {
            self.broken.extend(name.iter().map(|n| n.value.clone()));
        }
        let (name, span) = (name?, node.span.clone());
        let (scope, indices, kind) = (None, vec![], kind?);
        let pass = Pass { name, span, when, group, each, only, defines, entry, bind, mips, set, scope, indices, kind };
        Some(match tune {
            Some(tune) => self.tuned(pass, tune),
            None => pass,
        })
    }

    /// One name, or a list with that of each stage.
    fn entries(&mut self, node: Option<&SyntaxNode>) -> Vec<Name> {
        match node {
            Some(SyntaxNode { kind: SyntaxKind::List(names), .. }) => {
                names.iter().filter_map(|n| self.text(n)).collect()
            }
            node => node.and_then(|n| self.text(n)).into_iter().collect(),
        }
    }

    /// `Dirty(bits: "b", of: ["r"])`.
    fn dirty(&mut self, node: &SyntaxNode) -> Option<Dirty> {
        let (_, mut f) = self.named(node, &["Dirty"])?;
        let bits = self.need(&mut f, "bits").and_then(|n| self.name(n));
        let of = self.need(&mut f, "of");
        let of = self.list(of).iter().filter_map(|n| self.name(n)).collect();
        self.finish(&f);
        Some(Dirty { bits: bits?, of })
    }

    fn pass_kind(&mut self, word: &str, f: &mut Fields) -> Option<PassKind> {
        match word {
            "Draw" => self.raster(f, true).map(PassKind::Draw),
            "Screen" => self.raster(f, false).map(PassKind::Screen),
            "Compute" => {
                let shader = self.need(f, "shader").and_then(|n| self.text(n));
                let over = match f.get("over") {
                    Some(n) => Some(self.size(n)?),
                    None => None,
                };
                let indirect = f.get("indirect");
                if let (Some(node), Some(each)) = (indirect, f.get("each")) {
                    let d = Diagnostic::error("one list of counts can't be that of each instance").at(&node.span, "");
                    self.fault(d.at(&each.span, "").help("leave `each` out, or `indirect`"));
                }
                let indirect = indirect.and_then(|n| self.name(n));
                Some(PassKind::Compute { shader: shader?, over, indirect })
            }
            "Reduce" => {
                let shader = self.need(f, "shader").and_then(|n| self.text(n));
                let from = self.need(f, "from").and_then(|n| self.name(n));
                let to = self.need(f, "to").and_then(|n| self.name(n));
                let factor = self.need(f, "factor").and_then(|n| self.size(n));
                let until = match f.get("until") {
                    Some(n) => self.expr(n)?,
                    None => Expr::parse(&Span::new(&f.span.source, f.span.start..f.span.start), "1").ok()?,
                };
                let factor = factor?.exprs().to_vec();
                Some(PassKind::Reduce { shader: shader?, from: from?, to: to?, factor, until })
            }
            "Copy" => {
                let from = self.need(f, "from").and_then(|n| self.name(n));
                let to = self.need(f, "to").and_then(|n| self.name(n));
                Some(PassKind::Copy { from: from?, to: to? })
            }
            "Clear" => {
                let target = self.need(f, "target").and_then(|n| self.name(n));
                let value = f.get("value").map_or(Some([0.0; 4]), |n| self.color(n));
                Some(PassKind::Clear { target: target?, value: value? })
            }
            "Scan" => {
                let from = self.need(f, "from").and_then(|n| self.name(n));
                let to = self.need(f, "to").and_then(|n| self.name(n));
                let inclusive = self.bool(f.get("inclusive"), false);
                Some(PassKind::Scan { from: from?, to: to?, inclusive })
            }
            "Mips" => {
                let of = self.need(f, "of").and_then(|n| self.name(n));
                Some(PassKind::Mips { of: of? })
            }
            "Fastest" => {
                let of = self.need(f, "of");
                let of = self.list(of).iter().map(|n| self.passes(Some(n))).collect();
                Some(PassKind::Fastest { of, once: self.bool(f.get("once"), false) })
            }
            "For" => {
                let count = self.need(f, "count").and_then(|n| self.expr(n));
                let passes = self.need(f, "passes");
                let passes = self.passes(passes);
                Some(PassKind::For { count: count?, passes })
            }
            _ => {
                let count = self.need(f, "count").and_then(|n| self.expr(n));
                let until = f.get("until").and_then(|n| self.expr(n));
                let passes = self.need(f, "passes");
                let passes = self.passes(passes);
                Some(PassKind::Loop { count: count?, until, passes })
            }
        }
    }
}

/// The kinds of parameters, with what is blank of each.
const VALUES: [(&str, Value); 9] = [
    ("Bool", Value::Bool(false)),
    ("Uint", Value::Uint(0)),
    ("Int", Value::Int(0)),
    ("Float", Value::Float(0.0)),
    ("UVec2", Value::UVec2(UVec2::ZERO)),
    ("UVec3", Value::UVec3(UVec3::ZERO)),
    ("Vec2", Value::Vec2(Vec2::ZERO)),
    ("Vec3", Value::Vec3(Vec3::ZERO)),
    ("Vec4", Value::Vec4(Vec4::ZERO)),
];

/// The names of [`FORMATS`].
static FORMAT_NAMES: LazyLock<[String; FORMATS.len()]> = LazyLock::new(|| FORMATS.map(|f| format!("{f:?}")));

/// The formats a graph may name.
pub const FORMATS: [wgpu_types::TextureFormat; 33] = {
    use wgpu_types::TextureFormat as F;
    [
        F::R8Unorm,
        F::R8Snorm,
        F::R8Uint,
        F::R8Sint,
        F::R16Uint,
        F::R16Sint,
        F::R16Float,
        F::Rg8Unorm,
        F::Rg8Snorm,
        F::Rg8Uint,
        F::Rg8Sint,
        F::R32Uint,
        F::R32Sint,
        F::R32Float,
        F::Rg16Uint,
        F::Rg16Sint,
        F::Rg16Float,
        F::Rgba8Unorm,
        F::Rgba8UnormSrgb,
        F::Rgba8Snorm,
        F::Rgba8Uint,
        F::Rgba8Sint,
        F::Rgb10a2Unorm,
        F::Rg11b10Ufloat,
        F::Rg32Uint,
        F::Rg32Float,
        F::Rgba16Uint,
        F::Rgba16Float,
        F::Rgba32Uint,
        F::Rgba32Sint,
        F::Rgba32Float,
        F::Depth32Float,
        F::Depth16Unorm,
    ]
};

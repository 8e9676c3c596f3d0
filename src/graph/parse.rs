//! The tree of a file to its [`Graph`]: shapes, keys and literals. Gathers every fault.

use super::ast::{Graph, Name, Param, Pass, PassKind, Raster, Resource, ResourceKind, Size, Spanned};
use super::expr::{Expr, Val};
use super::tree::{Field, Kind, Node};
use crate::diag::{Diagnostic, Span, nearest};
use crate::plan::{Cull, SamplerDesc};
use crate::value::{Type, Value};

/// Reads parts of a tree and gathers the faults; what can't be read is left out and counted as a fault.
#[derive(Default)]
pub struct Reader {
    pub faults: Vec<Diagnostic>,
}

/// The fields of one struct that are still to be read.
pub struct Fields<'t> {
    what: String,
    span: &'t Span,
    fields: &'t [Field],
    asked: Vec<&'static str>,
}

impl<'t> Fields<'t> {
    /// An optional field. A second field of the same name is a fault when the struct is finished.
    pub fn get(&mut self, name: &'static str) -> Option<&'t Node> {
        self.asked.push(name);
        self.fields.iter().find(|f| f.name == name).map(|f| &f.value)
    }
}

impl Reader {
    fn fault(&mut self, d: Diagnostic) {
        self.faults.push(d);
    }

    /// A struct `Name(…)`, whose name must be among `names`; `None` and a fault otherwise.
    pub fn named<'t>(&mut self, node: &'t Node, names: &[&'static str]) -> Option<(&'static str, Fields<'t>)> {
        let (name, fields) = match &node.kind {
            Kind::Struct(Some(name), fields) => (name, fields.as_slice()),
            Kind::Word(name) => (name, [].as_slice()),
            _ => {
                self.fault(
                    Diagnostic::error(format!("expected {}", one_of(names)))
                        .at(&node.span, "")
                        .help("write it as `Name(field: value, …)`"),
                );
                return None;
            }
        };
        let Some(known) = names.iter().find(|n| *n == name) else {
            let d = Diagnostic::error(format!("unknown kind `{name}`, expected {}", one_of(names)));
            self.fault(d.at(&node.span, "").nearest(name, names.iter().copied()));
            return None;
        };
        Some((known, Fields { what: name.clone(), span: &node.span, fields, asked: vec![] }))
    }

    /// Reports the fields nobody asked for and those that stand twice.
    pub fn finish(&mut self, fields: &Fields) {
        for (i, f) in fields.fields.iter().enumerate() {
            if !fields.asked.contains(&f.name.as_str()) {
                let d =
                    Diagnostic::error(format!("`{}` has no field `{}`", fields.what, f.name)).at(&f.span, "unknown");
                let near = nearest(&f.name, fields.asked.iter().copied());
                let d = match near {
                    Some(n) => d.help(format!("did you mean `{n}`?")),
                    None => d.help(format!("it has {}", fields.asked.join(", "))),
                };
                self.fault(d);
            } else if fields.fields[..i].iter().any(|g| g.name == f.name) {
                self.fault(Diagnostic::error(format!("`{}` stands twice", f.name)).at(&f.span, "the second"));
            }
        }
    }

    /// A field that must be there.
    pub fn need<'t>(&mut self, fields: &mut Fields<'t>, name: &'static str) -> Option<&'t Node> {
        let node = fields.get(name);
        if node.is_none() {
            self.fault(Diagnostic::error(format!("`{}` needs a field `{name}`", fields.what)).at(fields.span, ""));
        }
        node
    }

    /// A quoted string.
    pub fn text(&mut self, node: &Node) -> Option<Name> {
        match &node.kind {
            Kind::Text(value) => Some(Spanned { value: value.clone(), span: inner(&node.span) }),
            _ => {
                self.fault(Diagnostic::error("expected a string in quotes").at(&node.span, ""));
                None
            }
        }
    }

    /// A name as WGSL and expressions can write it.
    pub fn name(&mut self, node: &Node) -> Option<Name> {
        let name = self.text(node)?;
        let good = name.value.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && name.value.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
            && !name.value.contains("__");
        if !good {
            self.fault(
                Diagnostic::error(format!("`{}` can't be a name", name.value))
                    .at(&name.span, "")
                    .help("use letters, digits and single underscores, a letter first"),
            );
            return None;
        }
        Some(name)
    }

    /// An expression: a string, a bare number or a boolean.
    pub fn expr(&mut self, node: &Node) -> Option<Expr> {
        let (text, span) = match &node.kind {
            Kind::Text(t) => (t, inner(&node.span)),
            Kind::Word(t) => (t, node.span.clone()),
            _ => {
                self.fault(Diagnostic::error("expected an expression: a string or a number").at(&node.span, ""));
                return None;
            }
        };
        match Expr::parse(&span, text) {
            Ok(e) => Some(e),
            Err(d) => {
                self.fault(d);
                None
            }
        }
    }

    fn bool(&mut self, node: Option<&Node>, default: bool) -> bool {
        match node.map(|n| (&n.kind, n)) {
            None => default,
            Some((Kind::Word(w), _)) if w == "true" || w == "false" => w == "true",
            Some((_, n)) => {
                self.fault(Diagnostic::error("expected `true` or `false`").at(&n.span, ""));
                default
            }
        }
    }

    fn number(&mut self, node: &Node) -> Option<f64> {
        let number = match &node.kind {
            Kind::Word(w) => w.parse::<f64>().ok().filter(|x| x.is_finite()),
            _ => None,
        };
        if number.is_none() {
            self.fault(Diagnostic::error("expected a finite number").at(&node.span, ""));
        }
        number
    }

    fn numbers(&mut self, node: &Node) -> Option<Vec<f64>> {
        match &node.kind {
            Kind::Tuple(None, items) => items.iter().map(|n| self.number(n)).collect(),
            _ => self.number(node).map(|x| vec![x]),
        }
    }

    /// Four numbers; one number stands for all four.
    fn color(&mut self, node: &Node) -> Option<[f64; 4]> {
        let v = self.numbers(node)?;
        match v[..] {
            [x] => Some([x; 4]),
            [x, y, z, w] => Some([x, y, z, w]),
            _ => {
                self.fault(Diagnostic::error("expected one number or four: (r, g, b, a)").at(&node.span, ""));
                None
            }
        }
    }

    /// One of some bare words.
    fn word<T: Copy>(&mut self, node: Option<&Node>, choices: &[(&'static str, T)], default: T) -> T {
        let Some(node) = node else { return default };
        let word = if let Kind::Word(w) = &node.kind { w.as_str() } else { "" };
        if let Some((_, v)) = choices.iter().find(|(n, _)| *n == word) {
            return *v;
        }
        let names: Vec<&str> = choices.iter().map(|c| c.0).collect();
        let d = Diagnostic::error(format!("expected {}", one_of(&names))).at(&node.span, "");
        self.fault(d.nearest(word, names.iter().copied()));
        default
    }

    /// The entries of `{…}`.
    pub fn map<'t>(&mut self, node: Option<&'t Node>) -> &'t [(Node, Node)] {
        match node.map(|n| (&n.kind, n)) {
            None => &[],
            Some((Kind::Map(pairs), _)) => pairs,
            Some((_, n)) => {
                self.fault(Diagnostic::error("expected a map `{\"name\": value}`").at(&n.span, ""));
                &[]
            }
        }
    }

    /// The items of `[…]`.
    pub fn list<'t>(&mut self, node: Option<&'t Node>) -> &'t [Node] {
        match node.map(|n| (&n.kind, n)) {
            None => &[],
            Some((Kind::List(items), _)) => items,
            Some((_, n)) => {
                self.fault(Diagnostic::error("expected a list `[…]`").at(&n.span, ""));
                &[]
            }
        }
    }

    /// A map from names to expressions.
    fn exprs(&mut self, node: Option<&Node>) -> Vec<(Name, Expr)> {
        let pairs = self.map(node).iter();
        pairs.filter_map(|(k, v)| Some((self.name(k)?, self.expr(v)?))).collect()
    }

    /// A map from names to names.
    pub fn names(&mut self, node: Option<&Node>) -> Vec<(Name, Name)> {
        let pairs = self.map(node).iter();
        pairs.filter_map(|(k, v)| Some((self.name(k)?, self.name(v)?))).collect()
    }

    /// A whole graph.
    pub fn graph(&mut self, fields: &mut Fields, span: &Span) -> Graph {
        let about = fields.get("about").and_then(|n| self.text(n)).map_or(String::new(), |n| n.value);
        let params = self.map(fields.get("params")).iter();
        let params = params.filter_map(|(k, v)| Some((self.name(k)?, self.param(v)?))).collect();
        let lets = self.exprs(fields.get("lets"));
        let defines = self.exprs(fields.get("defines"));
        let resources = self.map(fields.get("resources")).iter();
        let resources = resources.filter_map(|(k, v)| Some((self.name(k)?, self.resource(v)?))).collect();
        let passes = self.need(fields, "passes");
        let passes = self.list(passes).iter().filter_map(|n| self.pass(n)).collect();
        let outputs = self.need(fields, "outputs");
        let outputs = self.names(outputs);
        self.finish(fields);
        Graph { source: span.source.clone(), files: vec![], about, params, lets, defines, resources, passes, outputs }
    }

    /// `Float(default: …, min: …, max: …, about: "…")` and the like.
    pub fn param(&mut self, node: &Node) -> Option<Param> {
        const KINDS: [(&str, Type); 9] = [
            ("Bool", Type::Bool),
            ("Uint", Type::Uint),
            ("Int", Type::Int),
            ("Float", Type::Float),
            ("UVec2", Type::UVec2),
            ("UVec3", Type::UVec3),
            ("Vec2", Type::Vec2),
            ("Vec3", Type::Vec3),
            ("Vec4", Type::Vec4),
        ];
        let (name, mut fields) = self.named(node, &KINDS.map(|k| k.0))?;
        let ty = KINDS.iter().find(|k| k.0 == name).map_or(Type::Float, |k| k.1);
        let default = self.need(&mut fields, "default").and_then(|n| self.value(n, ty));
        let min = fields.get("min").and_then(|n| self.value(n, ty));
        let max = fields.get("max").and_then(|n| self.value(n, ty));
        let about = fields.get("about").and_then(|n| self.text(n)).map_or(String::new(), |n| n.value);
        self.finish(&fields);
        let param = Param { ty, default: default?, min, max, about, span: node.span.clone() };
        if let Err(why) = param.accepts(&param.default) {
            self.fault(Diagnostic::error(format!("the default is {why}")).at(&node.span, ""));
        }
        Some(param)
    }

    /// A literal of a type.
    pub fn value(&mut self, node: &Node, ty: Type) -> Option<Value> {
        let value = match (&node.kind, ty) {
            (Kind::Word(w), Type::Bool) => w.parse().ok().map(Value::Bool),
            (Kind::Word(w), Type::Uint) => w.parse().ok().map(Value::Uint),
            (Kind::Word(w), Type::Int) => w.parse().ok().map(Value::Int),
            (Kind::Word(w), Type::Float) => w.parse::<f32>().ok().filter(|x| x.is_finite()).map(Value::Float),
            (Kind::Tuple(None, items), _) => {
                let words: Vec<&str> = items.iter().map(|n| n.span.text()).collect();
                parse_vector(&words, ty)
            }
            _ => None,
        };
        if value.is_none() {
            self.fault(Diagnostic::error(format!("expected a {}", ty.wgsl())).at(&node.span, ""));
        }
        value
    }

    fn format(&mut self, node: &Node) -> Option<wgpu::TextureFormat> {
        let word = if let Kind::Word(w) = &node.kind { w.as_str() } else { "" };
        let found = FORMATS.iter().find(|f| format!("{f:?}") == word).copied();
        if found.is_none() {
            let names: Vec<String> = FORMATS.iter().map(|f| format!("{f:?}")).collect();
            let d = Diagnostic::error(format!("unknown texture format `{}`", node.span.text())).at(&node.span, "");
            let near = nearest(word, names.iter().map(String::as_str));
            let d = match near {
                Some(n) => d.help(format!("did you mean `{n}`?")),
                None => d.help(format!("formats are {}", names.join(", "))),
            };
            self.fault(d);
        }
        found
    }

    fn size(&mut self, node: &Node) -> Option<Size> {
        match &node.kind {
            Kind::Tuple(None, items) if (1..=3).contains(&items.len()) => {
                let axes = items.iter().map(|n| self.expr(n)).collect::<Option<_>>()?;
                Some(Size::Axes(axes, node.span.clone()))
            }
            _ => self.expr(node).map(Size::One),
        }
    }

    /// A resource declaration.
    pub fn resource(&mut self, node: &Node) -> Option<Resource> {
        const KINDS: [&str; 6] = ["Texture", "Texture3d", "Cube", "Atlas", "Buffer", "Sampler"];
        let (name, mut f) = self.named(node, &KINDS)?;
        let before = self.faults.len();
        let kind = if name == "Sampler" {
            let filter = [("Nearest", wgpu::FilterMode::Nearest), ("Linear", wgpu::FilterMode::Linear)];
            let address = [
                ("Clamp", wgpu::AddressMode::ClampToEdge),
                ("Repeat", wgpu::AddressMode::Repeat),
                ("Mirror", wgpu::AddressMode::MirrorRepeat),
            ];
            Some(ResourceKind::Sampler(SamplerDesc {
                filter: self.word(f.get("filter"), &filter, wgpu::FilterMode::Nearest),
                address: self.word(f.get("address"), &address, wgpu::AddressMode::ClampToEdge),
                compare: f.get("compare").map(|n| self.compare(Some(n), wgpu::CompareFunction::LessEqual)),
            }))
        } else if name == "Buffer" {
            let stride = self.need(&mut f, "stride").and_then(|n| self.expr(n));
            let count = self.need(&mut f, "count").and_then(|n| self.expr(n));
            stride.zip(count).map(|(stride, count)| ResourceKind::Buffer { stride, count })
        } else {
            let format = self.need(&mut f, "format").and_then(|n| self.format(n));
            if name == "Atlas" {
                let tile = self.need(&mut f, "tile").and_then(|n| self.expr(n));
                let count = self.need(&mut f, "count").and_then(|n| self.expr(n));
                format.zip(tile.zip(count)).map(|(format, (tile, count))| ResourceKind::Atlas { format, tile, count })
            } else {
                let size = self.need(&mut f, "size").and_then(|n| self.size(n));
                let mips = f.get("mips").and_then(|n| self.expr(n));
                let many = match name {
                    "Texture" => f.get("layers"),
                    "Cube" => f.get("count"),
                    _ => None,
                };
                let many = many.and_then(|n| self.expr(n));
                format.zip(size).map(|(format, size)| match name {
                    "Texture" => ResourceKind::Texture { format, size, layers: many, mips },
                    "Cube" => ResourceKind::Cube { format, size, count: many, mips },
                    _ => ResourceKind::Texture3d { format, size, mips },
                })
            }
        };
        let (mut history, mut initial, mut members) = (false, None, None);
        if name != "Sampler" {
            history = self.bool(f.get("history"), false);
            initial = f.get("initial").and_then(|n| self.color(n));
            members = f.get("members").and_then(|n| self.expr(n));
        }
        self.finish(&f);
        debug_assert!(kind.is_some() || self.faults.len() > before, "what can't be read is a fault");
        Some(Resource { span: node.span.clone(), kind: kind?, history, initial, members })
    }

    fn compare(&mut self, node: Option<&Node>, default: wgpu::CompareFunction) -> wgpu::CompareFunction {
        use wgpu::CompareFunction as C;
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

    /// A pass, bodies of loops included.
    pub fn pass(&mut self, node: &Node) -> Option<Pass> {
        const KINDS: [&str; 7] = ["Draw", "Screen", "Compute", "Reduce", "Copy", "Clear", "Loop"];
        let (word, mut f) = self.named(node, &KINDS)?;
        let name = self.need(&mut f, "name").and_then(|n| self.name(n));
        let when = f.get("when").and_then(|n| self.expr(n));
        let group = f.get("group").and_then(|n| self.text(n));
        let (mut each, mut defines, mut bind) = (None, vec![], vec![]);
        if word != "Loop" {
            each = f.get("each").and_then(|n| self.expr(n));
        }
        if matches!(word, "Draw" | "Screen" | "Compute" | "Reduce") {
            defines = self.exprs(f.get("defines"));
            bind = self.names(f.get("bind"));
        }
        let kind = self.pass_kind(word, &mut f);
        self.finish(&f);
        Some(Pass { name: name?, span: node.span.clone(), when, group, each, defines, bind, kind: kind? })
    }

    fn pass_kind(&mut self, word: &str, f: &mut Fields) -> Option<PassKind> {
        match word {
            "Draw" => self.raster(f, true).map(PassKind::Draw),
            "Screen" => self.raster(f, false).map(PassKind::Screen),
            "Compute" => {
                let shader = self.need(f, "shader").and_then(|n| self.text(n));
                let over = self.need(f, "over").and_then(|n| self.size(n));
                Some(PassKind::Compute { shader: shader?, over: over? })
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
            _ => {
                let count = self.need(f, "count").and_then(|n| self.expr(n));
                let until = f.get("until").and_then(|n| self.expr(n));
                let passes = self.need(f, "passes");
                let passes = self.list(passes).iter().filter_map(|n| self.pass(n)).collect();
                Some(PassKind::Loop { count: count?, until, passes })
            }
        }
    }

    fn raster(&mut self, f: &mut Fields, geometry: bool) -> Option<Raster> {
        let shader = self.need(f, "shader").and_then(|n| self.text(n));
        let color = f.get("color").and_then(|n| self.name(n));
        let depth = f.get("depth").and_then(|n| self.name(n));
        let depth_compare = self.compare(f.get("depth_compare"), wgpu::CompareFunction::Less);
        let depth_write = self.bool(f.get("depth_write"), true);
        let culls = [("None", Cull::None), ("Front", Cull::Front), ("Back", Cull::Back), ("Material", Cull::Material)];
        let cull = if geometry { self.word(f.get("cull"), &culls, Cull::Material) } else { Cull::None };
        let load = self.list(f.get("load")).iter().filter_map(|n| self.name(n)).collect();
        let clear = self.map(f.get("clear")).iter();
        let clear = clear.filter_map(|(k, v)| Some((self.name(k)?, self.color(v)?))).collect();
        let component = |operation| wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation,
        };
        let same = |operation| wgpu::BlendState { color: component(operation), alpha: component(operation) };
        let blends = [
            ("Add", Some(same(wgpu::BlendOperation::Add))),
            ("Max", Some(same(wgpu::BlendOperation::Max))),
            ("Min", Some(same(wgpu::BlendOperation::Min))),
            ("Alpha", Some(wgpu::BlendState::ALPHA_BLENDING)),
            ("None", None),
        ];
        let blend = self.word(f.get("blend"), &blends, None);
        let layer = f.get("layer").and_then(|n| self.expr(n));
        Some(Raster { shader: shader?, color, depth, depth_compare, depth_write, cull, load, clear, blend, layer })
    }
}

impl Param {
    /// Whether a value has the right type and lies in the range.
    ///
    /// # Errors
    /// What is wrong with it, as the end of a sentence: "below the minimum 1".
    pub fn accepts(&self, value: &Value) -> Result<(), String> {
        let parts = |v: &Value| match Val::from(*v) {
            Val::Bool(b) => vec![f64::from(u8::from(b))],
            Val::Int(i) => vec![i as f64],
            Val::Float(f) => vec![f],
            Val::Ints(v) => v.into_iter().map(|i| i as f64).collect(),
            Val::Floats(v) => v,
        };
        let v = parts(value);
        if value.ty() != self.ty {
            return Err(format!("not a {}", self.ty.wgsl()));
        }
        if v.iter().any(|x| !x.is_finite()) {
            return Err("not finite".into());
        }
        if let Some(min) = &self.min
            && v.iter().zip(parts(min)).any(|(a, b)| *a < b)
        {
            return Err(format!("below the minimum {min}"));
        }
        if let Some(max) = &self.max
            && v.iter().zip(parts(max)).any(|(a, b)| *a > b)
        {
            return Err(format!("above the maximum {max}"));
        }
        Ok(())
    }

    /// Reads a value as the command line writes it: `4`, `0.5`, `true`, `4,4,4`; a vector's single number stands for all.
    pub fn read(&self, text: &str) -> Option<Value> {
        let words: Vec<&str> = text.trim_matches(['(', ')']).split(',').map(str::trim).collect();
        match (self.ty, words[..].len()) {
            (Type::Bool, 1) => words[0].parse().ok().map(Value::Bool),
            (Type::Uint, 1) => words[0].parse().ok().map(Value::Uint),
            (Type::Int, 1) => words[0].parse().ok().map(Value::Int),
            (Type::Float, 1) => words[0].parse::<f32>().ok().filter(|x| x.is_finite()).map(Value::Float),
            (ty, 1) => {
                let n = match ty {
                    Type::UVec2 | Type::Vec2 => 2,
                    Type::UVec3 | Type::Vec3 => 3,
                    _ => 4,
                };
                parse_vector(&vec![words[0]; n], ty)
            }
            (ty, _) => parse_vector(&words, ty),
        }
    }
}

fn parse_vector(words: &[&str], ty: Type) -> Option<Value> {
    let val = match ty {
        Type::UVec2 | Type::UVec3 | Type::UVec4 => {
            Val::Ints(words.iter().map(|w| w.parse::<u32>().ok().map(i64::from)).collect::<Option<_>>()?)
        }
        Type::Vec2 | Type::Vec3 | Type::Vec4 => {
            let number = |w: &&str| w.parse::<f32>().ok().filter(|x| x.is_finite()).map(f64::from);
            Val::Floats(words.iter().map(number).collect::<Option<_>>()?)
        }
        _ => return None,
    };
    val.to_value().filter(|v| v.ty() == ty)
}

/// The place of a string's content, without its quotes.
fn inner(span: &Span) -> Span {
    Span::new(&span.source, span.start + 1..(span.end - 1).max(span.start + 1))
}

/// "`a`, `b` or `c`"
pub fn one_of(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|n| format!("`{n}`")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        Some((last, _)) => last.clone(),
        None => String::new(),
    }
}

/// The formats a graph may name.
pub const FORMATS: [wgpu::TextureFormat; 33] = {
    use wgpu::TextureFormat as F;
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

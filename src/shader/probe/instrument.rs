//! The instrumented copy: functions that the entry point reaches are copied and note their values; the others stay.

use super::super::{
    BindingKind, Layout, Shader, Stage, Variable, interface::Access, limits::on_deep_stack, oil::capabilities,
    write::plain,
};
use super::ir::Code;
use super::notes::{Identity, Notes};
use super::{FIRST, Probe, RING, Site, ValueShape};
use crate::content::hash;
use crate::diag::{Checked, Diagnostic};
use naga::valid::{FunctionInfo, ModuleInfo, ValidationFlags, Validator};
use naga::{
    AddressSpace, ArraySize, BinaryOperator, Block, Expression, Function, FunctionArgument, GlobalVariable, Handle,
    Module, ResourceBinding, Scalar, Span, Statement, StorageAccess, StructMember, Type, TypeInner,
};
use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZeroU32;

/// What the variables of the copy are called: no name of WGSL is spelt so.
const NAME: &str = "probe'";

/// A copy of a shader whose entry point notes what one invocation computes. With `only`, of `let`s and `var`s those of
/// these names.
///
/// # Errors
/// There is no such entry point, or none that can be asked.
pub fn instrument(shader: &Shader, entry: &str, only: &[String]) -> Checked<Probe> {
    on_deep_stack(|| copy(shader, entry, only))?
}

fn copy(shader: &Shader, name: &str, only: &[String]) -> Checked<Probe> {
    let described = shader.interface.entries.iter().find(|e| e.name == name);
    let entry = shader.module.entry_points.iter().position(|p| p.name == name);
    let (Some(described), Some(entry)) = (described, entry) else {
        return Err(Diagnostic::error(format!("{} has no entry point `{name}`", shader.path)).into());
    };
    let stage = described.stage;
    if stage == Stage::Vertex {
        return Err(Diagnostic::error(format!("`{name}` of {} is a vertex stage, which no place asks", shader.path))
            .help("probe the fragment stage: a pixel asks it")
            .into());
    }
    let mut validator = Validator::new(ValidationFlags::all(), capabilities());
    let info = validator
        .validate(&shader.module)
        .map_err(|e| Diagnostic::error(format!("{} can't be copied: {}", shader.path, plain(&e.to_string()))))?;
    let binding = shader.interface.variables.len();
    let mut module = shader.module.clone();
    let tools = Tools::declare(&mut module, binding as u32);
    let mut sites = Sites { all: vec![], only, left_out: 0, end: FIRST };
    let mut facts = Facts {
        module: &shader.module,
        info: info.get_entry_point(entry),
        tools: &tools,
        copies: BTreeMap::new(),
        uniforms: uniforms(&shader.module, info.get_entry_point(entry)),
    };
    functions(&mut module, (&info, entry), &mut facts, &mut sites);
    let mut function = std::mem::take(&mut module.entry_points[entry].function);
    let body = std::mem::take(&mut function.body);
    let identity = Identity::of(stage, &mut function, &mut module.types);
    let code = Code { function: &mut function, block: Block::new() };
    let mut notes = Notes { facts: &facts, code, sites: &mut sites, name: name.into(), entry: true };
    let given = notes.given();
    let body = notes.block(body);
    let mut whole = notes.claim(&identity);
    whole.extend_block(given);
    whole.extend_block(body);
    function.body = whole;
    module.entry_points[entry].function = function;
    tools.finish(&mut module, sites.all.len());

    let mut interface = shader.interface.clone();
    interface.variables.push(Variable {
        name: NAME.into(),
        kind: BindingKind::Storage {
            element: Layout { size: 4, members: vec![] },
            stride: 4,
            fixed_size: None,
            writable: true,
            of: None,
        },
    });
    if let Some(entry) = interface.entries.iter_mut().find(|e| e.name == name) {
        entry.uses.insert(binding, Access { read: true, write: true });
    }
    let content = hash(&("probe", shader.content, name, only));
    let shader = Shader { module, interface, content, ..shader.clone() };
    Ok(Probe { shader, stage, sites: sites.all, left_out: sites.left_out, region: sites.end })
}

/// The variables and functions that the copy has besides.
pub(super) struct Tools {
    pub buffer: Handle<GlobalVariable>,
    /// Where the region of this invocation begins; 0: it is not asked for.
    pub base: Handle<GlobalVariable>,
    /// The number of this invocation, from 1.
    pub run: Handle<GlobalVariable>,
    /// How often each site was reached.
    counts: Handle<GlobalVariable>,
    pub begin: Handle<Function>,
    pub put: Handle<Function>,
    pub uint: Handle<Type>,
}

/// Members of the buffer.
pub(super) const RUN_COUNT: u32 = 3;
const WORDS: u32 = 4;

impl Tools {
    fn declare(module: &mut Module, binding: u32) -> Tools {
        // Variables that are only named have the numbers behind.
        for (_, variable) in module.global_variables.iter_mut() {
            if let Some(at) = variable.binding.as_mut().filter(|at| at.binding >= binding) {
                at.binding += 1;
            }
        }
        let mut ty = |inner| module.types.insert(Type { name: None, inner }, Span::UNDEFINED);
        let uint = ty(TypeInner::Scalar(Scalar::U32));
        let atomic = ty(TypeInner::Atomic(Scalar::U32));
        let array = ty(TypeInner::Array { base: uint, size: ArraySize::Dynamic, stride: 4 });
        let member = |(i, ty): (usize, Handle<Type>)| {
            let name = Some(["x", "y", "z", "runs", "words"][i].to_owned());
            StructMember { name, ty, binding: None, offset: 4 * i as u32 }
        };
        let members = [uint, uint, uint, atomic, array].into_iter().enumerate().map(member).collect();
        let whole = TypeInner::Struct { members, span: 20 };
        let whole = module.types.insert(Type { name: Some(NAME.into()), inner: whole }, Span::UNDEFINED);
        let mut variable = |space, binding, ty| {
            let name = Some(NAME.to_owned());
            let memory_decorations = naga::MemoryDecorations::empty();
            let variable = GlobalVariable { name, space, binding, ty, init: None, memory_decorations };
            module.global_variables.append(variable, Span::UNDEFINED)
        };
        let storage = AddressSpace::Storage { access: StorageAccess::LOAD | StorageAccess::STORE };
        let buffer = variable(storage, Some(ResourceBinding { group: 0, binding }), whole);
        let (base, run) = (variable(AddressSpace::Private, None, uint), variable(AddressSpace::Private, None, uint));
        // Its length is known at the end.
        let counts = variable(AddressSpace::Private, None, uint);
        let begin = module.functions.append(Function::default(), Span::UNDEFINED);
        let mut tools = Tools { buffer, base, run, counts, begin, put: begin, uint };
        *module.functions.get_mut(begin) = tools.begin_function();
        tools.put = module.functions.append(tools.put_function(), Span::UNDEFINED);
        tools
    }

    fn finish(&self, module: &mut Module, sites: usize) {
        let size = ArraySize::Constant(NonZeroU32::new(sites as u32).unwrap_or(NonZeroU32::MIN));
        let inner = TypeInner::Array { base: self.uint, size, stride: 4 };
        let ty = module.types.insert(Type { name: None, inner }, Span::UNDEFINED);
        module.global_variables.get_mut(self.counts).ty = ty;
    }

    fn parameters(&self, names: &[&str]) -> Function {
        let argument = |name: &&str| FunctionArgument { name: Some((*name).into()), ty: self.uint, binding: None };
        Function { name: Some(NAME.into()), arguments: names.iter().map(argument).collect(), ..Function::default() }
    }

    /// `(site, at, words)`: counts that a site was reached; where its value goes, or 0.
    fn begin_function(&self) -> Function {
        let mut function = self.parameters(&["site", "at", "words"]);
        function.result = Some(naga::FunctionResult { ty: self.uint, binding: None });
        let mut code = Code { function: &mut function, block: Block::new() };
        let [site, at, words] = [0, 1, 2].map(|i| code.given(Expression::FunctionArgument(i)));
        let zero = code.number(0);
        let base = code.given(Expression::GlobalVariable(self.base));
        let base = code.load(base);
        let off = code.binary(BinaryOperator::Equal, base, zero);
        code.when(off, |code| code.push(Statement::Return { value: Some(zero) }));
        let [one, two, ring] = [1, 2, RING].map(|n| code.number(n));
        let counts = code.given(Expression::GlobalVariable(self.counts));
        let place = code.element(counts, site);
        let count = code.load(place);
        let next = code.add(count, one);
        code.store(place, next);
        let run = code.given(Expression::GlobalVariable(self.run));
        let run = code.load(run);
        let at = code.add(base, at);
        let place = self.word(&mut code, at);
        code.store(place, run);
        let second = code.add(at, one);
        let place = self.word(&mut code, second);
        code.store(place, next);
        let turn = code.binary(BinaryOperator::Modulo, count, ring);
        let offset = code.binary(BinaryOperator::Multiply, turn, words);
        let first = code.add(at, two);
        let first = code.add(first, offset);
        code.push(Statement::Return { value: Some(first) });
        function.body = code.block;
        function
    }

    /// `(at, k, word)`: writes the word with number `k` of a value, unless `at` is 0.
    fn put_function(&self) -> Function {
        let mut function = self.parameters(&["at", "k", "word"]);
        let mut code = Code { function: &mut function, block: Block::new() };
        let [at, k, word] = [0, 1, 2].map(|i| code.given(Expression::FunctionArgument(i)));
        let zero = code.number(0);
        let on = code.binary(BinaryOperator::NotEqual, at, zero);
        code.when(on, |code| {
            let at = code.add(at, k);
            let place = self.word(code, at);
            code.store(place, word);
        });
        code.push(Statement::Return { value: None });
        function.body = code.block;
        function
    }

    fn word(&self, code: &mut Code<'_>, at: Handle<Expression>) -> Handle<Expression> {
        let buffer = code.given(Expression::GlobalVariable(self.buffer));
        let words = code.member(buffer, WORDS);
        code.element(words, at)
    }
}

/// Copies the functions that the entry point reaches: what a function calls stands before it.
fn functions<'a>(
    module: &mut Module,
    (info, entry): (&'a ModuleInfo, usize),
    facts: &mut Facts<'a>,
    sites: &mut Sites<'_>,
) {
    let original = facts.module;
    let mut reached = BTreeSet::new();
    calls(&original.entry_points[entry].function.body, &mut reached);
    for (handle, function) in original.functions.iter().rev() {
        if reached.contains(&handle) {
            calls(&function.body, &mut reached);
        }
    }
    let of_entry = facts.info;
    for handle in reached {
        let mut function = original.functions[handle].clone();
        facts.info = &info[handle];
        let body = std::mem::take(&mut function.body);
        let name = function.name.as_deref().map(plain).unwrap_or_default();
        let code = Code { function: &mut function, block: Block::new() };
        let body = Notes { facts, code, sites, name, entry: false }.block(body);
        function.body = body;
        facts.copies.insert(handle, module.functions.append(function, Span::UNDEFINED));
    }
    facts.info = of_entry;
}

/// The functions that a block calls.
fn calls(block: &Block, out: &mut BTreeSet<Handle<Function>>) {
    for statement in block.iter() {
        match statement {
            Statement::Call { function, .. } => drop(out.insert(*function)),
            Statement::Block(inner) => calls(inner, out),
            Statement::If { accept, reject, .. } => [accept, reject].into_iter().for_each(|b| calls(b, out)),
            Statement::Switch { cases, .. } => cases.iter().for_each(|c| calls(&c.body, out)),
            Statement::Loop { body, continuing, .. } => [body, continuing].into_iter().for_each(|b| calls(b, out)),
            _ => {}
        }
    }
}

/// Uniforms of the entry point that are noted as a whole.
fn uniforms(module: &Module, info: &FunctionInfo) -> BTreeSet<Handle<GlobalVariable>> {
    let whole = |(handle, v): &(Handle<GlobalVariable>, &GlobalVariable)| {
        v.space == AddressSpace::Uniform
            && !info[*handle].is_empty()
            && ValueShape::of(module, &module.types[v.ty].inner).is_some()
    };
    module.global_variables.iter().filter(whole).map(|(handle, _)| handle).collect()
}

/// What is known of a function.
pub(super) struct Facts<'a> {
    /// As it was.
    pub module: &'a Module,
    pub info: &'a FunctionInfo,
    pub tools: &'a Tools,
    /// Copies of functions, by their originals.
    pub copies: BTreeMap<Handle<Function>, Handle<Function>>,
    /// Those that are noted as a whole.
    pub uniforms: BTreeSet<Handle<GlobalVariable>>,
}

pub(super) struct Sites<'a> {
    pub all: Vec<Site>,
    /// Names of `let`s and `var`s; none: all.
    pub only: &'a [String],
    pub left_out: usize,
    /// Words of a region so far.
    pub end: u32,
}

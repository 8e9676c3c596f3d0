//! A function that notes its values as it computes them.

use super::super::{Stage, write::plain};
use super::instrument::{Facts, RUN_COUNT, Sites};
use super::ir::{Code, ExprHandle};
use super::{FIRST, MOST_WORDS, Number, RUNS, Role, Site, ValueShape};
use naga::{
    AddressSpace, AtomicFunction, BinaryOperator, Binding, Block, BuiltIn, Expression, Function, FunctionArgument,
    GlobalVariable, Handle, Scalar, ScalarKind, Span, Statement, SwitchCase, Type, TypeInner, UniqueArena, VectorSize,
};

/// By which argument an invocation knows itself.
pub(super) struct Identity {
    argument: u32,
    /// Of an argument that is a struct.
    member: Option<u32>,
    stage: Stage,
}

impl Identity {
    /// Adds the argument where the entry point has none of the kind.
    pub fn of(stage: Stage, function: &mut Function, types: &mut UniqueArena<Type>) -> Identity {
        let is = |binding: &Option<Binding>| match binding {
            Some(Binding::BuiltIn(BuiltIn::GlobalInvocationId)) => stage == Stage::Compute,
            Some(Binding::BuiltIn(BuiltIn::Position { .. })) => stage == Stage::Fragment,
            _ => false,
        };
        for (argument, a) in (0..).zip(&function.arguments) {
            if is(&a.binding) {
                return Identity { argument, member: None, stage };
            }
            if let TypeInner::Struct { members, .. } = &types[a.ty].inner
                && let Some(member) = members.iter().position(|m| is(&m.binding))
            {
                return Identity { argument, member: Some(member as u32), stage };
            }
        }
        let (name, size, scalar, builtin) = match stage {
            Stage::Compute => ("invocation", VectorSize::Tri, Scalar::U32, BuiltIn::GlobalInvocationId),
            _ => ("position", VectorSize::Quad, Scalar::F32, BuiltIn::Position { invariant: false }),
        };
        let ty = types.insert(Type { name: None, inner: TypeInner::Vector { size, scalar } }, Span::UNDEFINED);
        let binding = Some(Binding::BuiltIn(builtin));
        function.arguments.push(FunctionArgument { name: Some(name.into()), ty, binding });
        Identity { argument: function.arguments.len() as u32 - 1, member: None, stage }
    }
}

/// Adds notes to one function.
pub(super) struct Notes<'a, 's> {
    pub facts: &'a Facts<'a>,
    pub code: Code<'a>,
    pub sites: &'a mut Sites<'s>,
    /// The function's name in the text.
    pub name: String,
    /// It is the entry point.
    pub entry: bool,
}

/// Where a pointer leads.
struct Path {
    /// `None`: to memory of the function itself, or of one that called it.
    global: Option<Handle<GlobalVariable>>,
    name: String,
    indices: Vec<ExprHandle>,
}

impl Notes<'_, '_> {
    /// The block with notes, as a function of the copy.
    pub fn block(&mut self, block: Block) -> Block {
        let outer = std::mem::take(&mut self.code.block);
        for (statement, span) in block.span_into_iter() {
            self.statement(statement, span);
        }
        std::mem::replace(&mut self.code.block, outer)
    }

    fn statement(&mut self, statement: Statement, span: Span) {
        let statement = match statement {
            Statement::Block(inner) => Statement::Block(self.block(inner)),
            Statement::If { condition, accept, reject } => {
                Statement::If { condition, accept: self.block(accept), reject: self.block(reject) }
            }
            Statement::Switch { selector, cases } => {
                let case = |c: SwitchCase| SwitchCase { body: self.block(c.body), ..c };
                Statement::Switch { selector, cases: cases.into_iter().map(case).collect() }
            }
            Statement::Loop { body, continuing, break_if } => {
                Statement::Loop { body: self.block(body), continuing: self.block(continuing), break_if }
            }
            Statement::Call { function, arguments, result } => {
                let function = self.facts.copies.get(&function).copied().unwrap_or(function);
                if let Some(result) = result {
                    self.code.function.expressions[result] = Expression::CallResult(function);
                }
                Statement::Call { function, arguments, result }
            }
            other => other,
        };
        if let (Statement::Return { value: Some(value) }, true) = (&statement, self.entry) {
            self.returned(*value);
        }
        let done = statement.clone();
        self.code.block.push(statement, span);
        match done {
            Statement::Emit(range) => range.for_each(|value| self.computed(value)),
            Statement::Call { result: Some(result), .. }
            | Statement::WorkGroupUniformLoad { result, .. }
            | Statement::SubgroupBallot { result, .. }
            | Statement::SubgroupGather { result, .. }
            | Statement::SubgroupCollectiveOperation { result, .. } => self.named(result),
            Statement::Store { pointer, value } => self.stored(pointer, value),
            Statement::Atomic { pointer, value, result, .. } => {
                self.stored(pointer, value);
                result.into_iter().for_each(|r| self.named(r));
            }
            Statement::ImageStore { image, coordinate, array_index, value }
            | Statement::ImageAtomic { image, coordinate, array_index, value, .. } => {
                self.texel(Role::Write, image, (coordinate, array_index), value);
            }
            _ => {}
        }
    }

    /// Notes what an entry point is given: its arguments and its uniforms.
    pub fn given(&mut self) -> Block {
        for i in 0..self.code.function.arguments.len() {
            let argument = &self.code.function.arguments[i];
            let name = argument.name.as_deref().map(plain).unwrap_or_default();
            // The type of one that was added is not among the original's.
            let shape = match &argument.binding {
                Some(Binding::BuiltIn(BuiltIn::Position { .. })) => Some(ValueShape::Vector(Number::Float, 4)),
                Some(Binding::BuiltIn(BuiltIn::GlobalInvocationId)) => Some(ValueShape::Vector(Number::Uint, 3)),
                _ => ValueShape::of(self.facts.module, &self.facts.module.types[argument.ty].inner),
            };
            if let Some(shape) = shape {
                let value = self.code.given(Expression::FunctionArgument(i as u32));
                self.note(Role::Argument, name, vec![], (value, shape));
            }
        }
        for handle in &self.facts.uniforms {
            let variable = &self.facts.module.global_variables[*handle];
            let name = variable.name.as_deref().map(plain).unwrap_or_default();
            if let Some(shape) = ValueShape::of(self.facts.module, &self.facts.module.types[variable.ty].inner) {
                let pointer = self.code.given(Expression::GlobalVariable(*handle));
                let value = self.code.load(pointer);
                self.note(Role::Uniform, name, vec![], (value, shape));
            }
        }
        std::mem::take(&mut self.code.block)
    }

    /// Where this is the invocation that is asked for, gives it a region.
    pub fn claim(&mut self, identity: &Identity) -> Block {
        let (code, tools, region) = (&mut self.code, self.facts.tools, self.sites.end);
        let mut place = code.given(Expression::FunctionArgument(identity.argument));
        if let Some(member) = identity.member {
            place = code.member(place, member);
        }
        let buffer = code.given(Expression::GlobalVariable(tools.buffer));
        let (numbers, fragment) = match identity.stage {
            Stage::Compute => (3, false),
            Stage::Fragment | Stage::Vertex => (2, true),
        };
        let mut asked = None;
        for i in 0..numbers {
            let wanted = code.member(buffer, i);
            let wanted = code.load(wanted);
            let mut is = code.member(place, i);
            if fragment {
                is = code.computed(Expression::As { expr: is, kind: ScalarKind::Uint, convert: Some(4) });
            }
            let same = code.binary(BinaryOperator::Equal, is, wanted);
            asked = Some(match asked {
                Some(before) => code.binary(BinaryOperator::LogicalAnd, before, same),
                None => same,
            });
        }
        let [one, runs, region, first] = [1, RUNS, region, FIRST].map(|n| code.number(n));
        let [base, run] = [tools.base, tools.run].map(|v| code.given(Expression::GlobalVariable(v)));
        let before = code.given(Expression::AtomicResult { ty: tools.uint, comparison: false });
        if let Some(asked) = asked {
            code.when(asked, |code| {
                let pointer = code.member(buffer, RUN_COUNT);
                code.push(Statement::Atomic { pointer, fun: AtomicFunction::Add, value: one, result: Some(before) });
                let turn = code.binary(BinaryOperator::Modulo, before, runs);
                let offset = code.binary(BinaryOperator::Multiply, turn, region);
                let begin = code.add(first, offset);
                code.store(base, begin);
                let number = code.add(before, one);
                code.store(run, number);
            });
        }
        std::mem::take(&mut code.block)
    }

    fn computed(&mut self, value: ExprHandle) {
        self.named(value);
        match self.code.function.expressions[value] {
            Expression::Load { pointer } => {
                let Some(path) = self.path(pointer) else { return };
                let Some(global) = path.global.filter(|g| !self.facts.uniforms.contains(g)) else { return };
                let space = self.facts.module.global_variables[global].space;
                if space != AddressSpace::Private {
                    self.at(Role::Read, path, value);
                }
            }
            Expression::ImageLoad { image, coordinate, array_index, .. }
            | Expression::ImageSample { image, coordinate, array_index, .. } => {
                self.texel(Role::Read, image, (coordinate, array_index), value);
            }
            _ => {}
        }
    }

    fn named(&mut self, value: ExprHandle) {
        if let (Some(name), Some(shape)) = (self.code.function.named_expressions.get(&value), self.shape(value)) {
            let name = plain(name);
            self.note(Role::Let, name, vec![], (value, shape));
        }
    }

    fn stored(&mut self, pointer: ExprHandle, value: ExprHandle) {
        let Some(path) = self.path(pointer) else { return };
        let space = path.global.map(|g| self.facts.module.global_variables[g].space);
        let role = match space {
            None | Some(AddressSpace::Private | AddressSpace::WorkGroup) => Role::Var,
            _ => Role::Write,
        };
        self.at(role, path, value);
    }

    fn texel(
        &mut self,
        role: Role,
        image: ExprHandle,
        (at, layer): (ExprHandle, Option<ExprHandle>),
        value: ExprHandle,
    ) {
        if let Some(mut path) = self.path(image) {
            for index in [Some(at), layer].into_iter().flatten() {
                path.name.push_str("[]");
                path.indices.push(index);
            }
            self.at(role, path, value);
        }
    }

    fn returned(&mut self, value: ExprHandle) {
        match self.shape(value) {
            Some(ValueShape::Struct(members)) => {
                for (i, (name, shape)) in (0..).zip(members) {
                    let value = self.code.member(value, i);
                    self.note(Role::Return, name, vec![], (value, shape));
                }
            }
            Some(shape) => self.note(Role::Return, "result".into(), vec![], (value, shape)),
            None => {}
        }
    }

    fn at(&mut self, role: Role, path: Path, value: ExprHandle) {
        let indices: Option<Vec<_>> = path.indices.into_iter().map(|i| Some((i, self.shape(i)?))).collect();
        if let (Some(indices), Some(shape)) = (indices, self.shape(value)) {
            self.note(role, path.name, indices, (value, shape));
        }
    }

    fn note(
        &mut self,
        role: Role,
        name: String,
        indices: Vec<(ExprHandle, ValueShape)>,
        (value, shape): (ExprHandle, ValueShape),
    ) {
        let root = name.split(['.', '[']).next().unwrap_or_default();
        let chosen = self.sites.only.is_empty() || self.sites.only.iter().any(|n| n == root);
        if !chosen && matches!(role, Role::Let | Role::Var | Role::Read) {
            return;
        }
        let shapes = indices.iter().map(|i| i.1.clone()).collect();
        let function = self.name.clone();
        let site = Site { role, function, name, indices: shapes, shape: shape.clone(), at: self.sites.end };
        let Some(end) = self.sites.end.checked_add(site.room()).filter(|end| *end <= MOST_WORDS) else {
            self.sites.left_out += 1;
            return;
        };
        let tools = self.facts.tools;
        let arguments = [self.sites.all.len() as u32, site.at, site.words()].map(|n| self.code.number(n)).to_vec();
        self.sites.end = end;
        self.sites.all.push(site);
        let at = self.code.given(Expression::CallResult(tools.begin));
        self.code.push(Statement::Call { function: tools.begin, arguments, result: Some(at) });
        let mut words = vec![];
        for (value, shape) in indices.into_iter().chain([(value, shape)]) {
            self.words(value, &shape, &mut words);
        }
        for (k, word) in (0..).zip(words) {
            let k = self.code.number(k);
            self.code.push(Statement::Call { function: tools.put, arguments: vec![at, k, word], result: None });
        }
    }

    /// The words of a value, as [`ValueShape`] counts them.
    fn words(&mut self, value: ExprHandle, shape: &ValueShape, out: &mut Vec<ExprHandle>) {
        let mut parts = |count: u32, shape: &ValueShape| {
            for i in 0..count {
                let part = self.code.member(value, i);
                self.words(part, shape, out);
            }
        };
        match shape {
            ValueShape::Number(number) => out.push(self.word(value, *number)),
            ValueShape::Vector(number, n) => parts(*n, &ValueShape::Number(*number)),
            ValueShape::Matrix(number, columns, rows) => parts(*columns, &ValueShape::Vector(*number, *rows)),
            ValueShape::Array(of, n) => parts(*n, of),
            ValueShape::Struct(members) => {
                for (i, (_, shape)) in (0..).zip(members) {
                    let part = self.code.member(value, i);
                    self.words(part, shape, out);
                }
            }
        }
    }

    fn word(&mut self, value: ExprHandle, number: Number) -> ExprHandle {
        let code = &mut self.code;
        match number {
            Number::Uint => value,
            Number::Float | Number::Int => code.bits(value),
            Number::Half => {
                let wide = Expression::As { expr: value, kind: ScalarKind::Float, convert: Some(4) };
                let wide = code.computed(wide);
                code.bits(wide)
            }
            Number::Bool => {
                let (accept, reject) = (code.number(1), code.number(0));
                code.computed(Expression::Select { condition: value, accept, reject })
            }
        }
    }

    /// Of an expression of the original.
    fn shape(&self, value: ExprHandle) -> Option<ValueShape> {
        ValueShape::of(self.facts.module, self.inner(value))
    }

    fn inner(&self, value: ExprHandle) -> &TypeInner {
        self.facts.info[value].ty.inner_with(&self.facts.module.types)
    }

    fn path(&self, pointer: ExprHandle) -> Option<Path> {
        let (function, module) = (&*self.code.function, self.facts.module);
        let named = |global, name: &Option<String>| {
            let name = name.as_deref().map(plain)?;
            Some(Path { global, name, indices: vec![] })
        };
        match function.expressions[pointer] {
            Expression::GlobalVariable(g) => named(Some(g), &module.global_variables[g].name),
            Expression::LocalVariable(v) => named(None, &function.local_variables[v].name),
            Expression::FunctionArgument(i) => named(None, &function.arguments.get(i as usize)?.name),
            Expression::AccessIndex { base, index } => {
                let mut path = self.path(base)?;
                let inner = match self.inner(base) {
                    TypeInner::Pointer { base, .. } => &module.types[*base].inner,
                    inner => inner,
                };
                path.name.push_str(&match inner {
                    TypeInner::Struct { members, .. } => {
                        format!(".{}", members.get(index as usize)?.name.as_deref().map(plain)?)
                    }
                    TypeInner::Vector { .. } | TypeInner::ValuePointer { .. } => {
                        format!(".{}", ["x", "y", "z", "w"].get(index as usize)?)
                    }
                    _ => format!("[{index}]"),
                });
                Some(path)
            }
            Expression::Access { base, index } => {
                let mut path = self.path(base)?;
                path.name.push_str("[]");
                path.indices.push(index);
                Some(path)
            }
            _ => None,
        }
    }
}

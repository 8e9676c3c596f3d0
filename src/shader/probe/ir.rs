//! Expressions and statements of naga, in a few words.

use naga::{BinaryOperator, Block, Expression, Function, Handle, Literal, ScalarKind, Span, Statement};

/// The end of a block of a function, to which code is added.
pub(super) struct Code<'f> {
    pub function: &'f mut Function,
    pub block: Block,
}

pub(super) type ExprHandle = Handle<Expression>;

impl Code<'_> {
    /// What is there from the start of the function: literals, variables, arguments.
    pub fn given(&mut self, expression: Expression) -> ExprHandle {
        self.function.expressions.append(expression, Span::UNDEFINED)
    }

    pub fn number(&mut self, n: u32) -> ExprHandle {
        self.given(Expression::Literal(Literal::U32(n)))
    }

    /// What is computed here.
    pub fn computed(&mut self, expression: Expression) -> ExprHandle {
        let value = self.given(expression);
        self.block.push(Statement::Emit(naga::Range::new_from_bounds(value, value)), Span::UNDEFINED);
        value
    }

    pub fn load(&mut self, pointer: ExprHandle) -> ExprHandle {
        self.computed(Expression::Load { pointer })
    }

    pub fn member(&mut self, base: ExprHandle, index: u32) -> ExprHandle {
        self.computed(Expression::AccessIndex { base, index })
    }

    pub fn element(&mut self, base: ExprHandle, index: ExprHandle) -> ExprHandle {
        self.computed(Expression::Access { base, index })
    }

    pub fn binary(&mut self, op: BinaryOperator, left: ExprHandle, right: ExprHandle) -> ExprHandle {
        self.computed(Expression::Binary { op, left, right })
    }

    pub fn add(&mut self, left: ExprHandle, right: ExprHandle) -> ExprHandle {
        self.binary(BinaryOperator::Add, left, right)
    }

    /// The bits of a number of four bytes.
    pub fn bits(&mut self, expr: ExprHandle) -> ExprHandle {
        self.computed(Expression::As { expr, kind: ScalarKind::Uint, convert: None })
    }

    pub fn store(&mut self, pointer: ExprHandle, value: ExprHandle) {
        self.push(Statement::Store { pointer, value });
    }

    pub fn push(&mut self, statement: Statement) {
        self.block.push(statement, Span::UNDEFINED);
    }

    /// What `then` adds happens where the condition holds.
    pub fn when(&mut self, condition: ExprHandle, then: impl FnOnce(&mut Self)) {
        let outer = std::mem::take(&mut self.block);
        then(self);
        let accept = std::mem::replace(&mut self.block, outer);
        self.push(Statement::If { condition, accept, reject: Block::new() });
    }
}

//! The text of an expression to its tree.

use super::{Binary, Expr, ExprKind, Function, Unary, Val};
use crate::diag::{Diagnostic, Span};

/// By name: what it does, and how many values it takes.
pub const FUNCTIONS: [(&str, Function, usize); 12] = [
    ("min", Function::Min, 2),
    ("max", Function::Max, 2),
    ("clamp", Function::Clamp, 3),
    ("abs", Function::Abs, 1),
    ("floor", Function::Floor, 1),
    ("ceil", Function::Ceil, 1),
    ("round", Function::Round, 1),
    ("ceil_div", Function::CeilDiv, 2),
    ("log2", Function::Log2, 1),
    ("pow", Function::Pow, 2),
    ("vec2", Function::Vector, 2),
    ("vec3", Function::Vector, 3),
];

impl Expr {
    /// Parses `text`, which stands at `span`'s start.
    ///
    /// # Errors
    /// The first fault of syntax.
    pub fn parse(span: &Span, text: &str) -> Result<Expr, Diagnostic> {
        let mut p = ExprParser { span, text, at: 0, depth: 0, operators: 0 };
        let e = p.choose()?;
        p.skip();
        if p.at < text.len() {
            return Err(p.fault("unexpected text in the expression"));
        }
        Ok(e)
    }
}

/// Deeper nesting than this is a fault, so that no text can overflow the stack.
pub(super) const DEPTH: usize = 64;

/// Longer chains of operators are a fault: they make trees as deep as they are long.
pub(super) const OPERATORS: usize = 200;

struct ExprParser<'a> {
    span: &'a Span,
    text: &'a str,
    at: usize,
    depth: usize,
    operators: usize,
}

impl ExprParser<'_> {
    fn skip(&mut self) {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
    }

    fn fault(&self, message: &str) -> Diagnostic {
        let start = self.span.start + self.at;
        Diagnostic::error(message)
            .at(&Span::new(&self.span.source, start..(start + 1).min(self.span.end.max(start))), "")
    }

    fn take(&mut self, token: &str) -> bool {
        self.skip();
        let found = self.text[self.at..].starts_with(token);
        if found {
            self.at += token.len();
        }
        found
    }

    fn count_operator(&mut self) -> Result<(), Diagnostic> {
        self.operators += 1;
        if self.operators > OPERATORS { Err(self.fault("the expression is too long")) } else { Ok(()) }
    }

    fn expr(&self, start: usize, kind: ExprKind) -> Expr {
        Expr { span: Span::new(&self.span.source, self.span.start + start..self.span.start + self.at), kind }
    }

    fn choose(&mut self) -> Result<Expr, Diagnostic> {
        self.depth += 1;
        if self.depth > DEPTH {
            return Err(self.fault("the expression is nested too deep"));
        }
        self.skip();
        let start = self.at;
        let mut e = self.joined(0)?;
        if self.take("?") {
            let a = self.choose()?;
            if !self.take(":") {
                return Err(self.fault("expected `:`"));
            }
            let b = self.choose()?;
            e = self.expr(start, ExprKind::Choose(Box::new(e), Box::new(a), Box::new(b)));
        }
        self.depth -= 1;
        Ok(e)
    }

    /// Operands joined by operators that bind at least as closely as `least`.
    fn joined(&mut self, least: u8) -> Result<Expr, Diagnostic> {
        self.skip();
        let start = self.at;
        let mut e = self.unary()?;
        while let Some((token, binds, op)) = self.operator().filter(|o| o.1 >= least) {
            self.at += token.len();
            self.count_operator()?;
            let right = self.joined(binds + 1)?;
            e = self.expr(start, ExprKind::Binary(op, Box::new(e), Box::new(right)));
        }
        Ok(e)
    }

    /// The operator that comes next, and how closely it binds.
    fn operator(&mut self) -> Option<(&'static str, u8, Binary)> {
        // Longer tokens come first; `<` must not take the start of `<=`.
        const OPERATORS: [(&str, u8, Binary); 13] = [
            ("||", 0, Binary::Or),
            ("&&", 1, Binary::And),
            ("==", 2, Binary::Equal),
            ("!=", 2, Binary::NotEqual),
            ("<=", 2, Binary::LessEqual),
            (">=", 2, Binary::GreaterEqual),
            ("<", 2, Binary::Less),
            (">", 2, Binary::Greater),
            ("+", 3, Binary::Add),
            ("-", 3, Binary::Sub),
            ("*", 4, Binary::Mul),
            ("/", 4, Binary::Div),
            ("%", 4, Binary::Rem),
        ];
        self.skip();
        let rest = &self.text[self.at..];
        OPERATORS.into_iter().find(|(token, ..)| rest.starts_with(token))
    }

    fn unary(&mut self) -> Result<Expr, Diagnostic> {
        self.skip();
        let start = self.at;
        let op = if self.take("-") {
            Unary::Minus
        } else if self.take("!") {
            Unary::Not
        } else {
            return self.postfix();
        };
        self.depth += 1;
        if self.depth > DEPTH {
            return Err(self.fault("the expression is nested too deep"));
        }
        let inner = self.unary()?;
        self.depth -= 1;
        Ok(self.expr(start, ExprKind::Unary(op, Box::new(inner))))
    }

    fn postfix(&mut self) -> Result<Expr, Diagnostic> {
        self.skip();
        let start = self.at;
        let mut e = self.primary()?;
        loop {
            if let ExprKind::Name(set) = &e.kind
                && self.take("[")
            {
                let set = set.clone();
                let index = self.choose()?;
                if !self.take("]") {
                    return Err(self.fault("expected `]`"));
                }
                self.count_operator()?;
                e = self.expr(start, ExprKind::Item(set, Box::new(index)));
            }
            if !self.take(".") {
                return Ok(e);
            }
            let rest = &self.text[self.at..];
            let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
            let word = &rest[..end];
            let parts: Option<Vec<usize>> = word.chars().map(|c| "xyzw".find(c)).collect();
            let kind = match (parts, &e.kind) {
                (Some(parts), _) if (1..=4).contains(&parts.len()) => ExprKind::Parts(Box::new(e), parts),
                // What a sub-graph has under a name of its own.
                (_, ExprKind::Name(outer)) if end > 0 => ExprKind::Name(format!("{outer}.{word}")),
                _ => return Err(self.fault("expected `x`, `y`, `z` or `w`")),
            };
            self.at += end;
            self.count_operator()?;
            e = self.expr(start, kind);
        }
    }

    fn primary(&mut self) -> Result<Expr, Diagnostic> {
        self.skip();
        let start = self.at;
        if self.take("(") {
            let e = self.choose()?;
            if !self.take(")") {
                return Err(self.fault("expected `)`"));
            }
            return Ok(e);
        }
        let rest = &self.text[self.at..];
        let first = rest.chars().next();
        if first.is_some_and(|c| c.is_ascii_digit()) {
            let mut end = 0;
            let bytes = rest.as_bytes();
            while end < bytes.len()
                && (bytes[end].is_ascii_digit()
                    || bytes[end] == b'.' && bytes.get(end + 1).is_some_and(u8::is_ascii_digit)
                    || matches!(bytes[end], b'e' | b'E')
                    || matches!(bytes[end], b'+' | b'-') && matches!(bytes[end - 1], b'e' | b'E'))
            {
                end += 1;
            }
            let number = &rest[..end];
            let val = match number.parse::<i64>() {
                Ok(i) => Val::Int(i),
                Err(_) if number.contains(['.', 'e', 'E']) => {
                    number.parse().map(Val::Float).map_err(|_| self.fault("not a number"))?
                }
                Err(_) => return Err(self.fault("the number doesn't fit 64 bits")),
            };
            self.at += end;
            return Ok(self.expr(start, ExprKind::Number(val)));
        }
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        if end == 0 {
            return Err(self.fault("expected a number, a name or `(`"));
        }
        let name = rest[..end].to_string();
        self.at += end;
        let after_name = self.at;
        if self.take("(") {
            let Some((_, f, arity)) = FUNCTIONS.iter().find(|(n, ..)| *n == name) else {
                let d = Diagnostic::error(format!("unknown function `{name}`"));
                let span = Span::new(&self.span.source, self.span.start + start..self.span.start + after_name);
                return Err(d.at(&span, "").nearest(&name, FUNCTIONS.iter().map(|f| f.0)));
            };
            let mut args = vec![];
            while !self.take(")") {
                if !args.is_empty() && !self.take(",") {
                    return Err(self.fault("expected `,` or `)`"));
                }
                args.push(self.choose()?);
            }
            if args.len() != *arity {
                return Err(self.fault(&format!("`{name}` takes {arity} values")));
            }
            return Ok(self.expr(start, ExprKind::Call(*f, args)));
        }
        self.at = after_name;
        Ok(match name.as_str() {
            "true" => self.expr(start, ExprKind::Number(Val::Bool(true))),
            "false" => self.expr(start, ExprKind::Number(Val::Bool(false))),
            _ => self.expr(start, ExprKind::Name(name)),
        })
    }
}

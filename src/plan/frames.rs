//! Passes that run in some frames: `when: "first_frame"`, and what goes with it.

use super::wire::{Mode, Wired, Wirer};
use crate::diag::Diagnostic;
use crate::graph::ast::{Pass, PassKind, Resource};
use crate::graph::check::FIRST_FRAME;
use crate::graph::expr::{Expr, Val};
use crate::value::{Value, Values};

/// The frames in which a step runs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum Frames {
    #[default]
    All,
    /// Those with which history begins.
    First,
    /// All others.
    Later,
}

impl Frames {
    /// Whether the frame with these values is one of them.
    pub fn include(self, values: &Values) -> bool {
        let first = values.get(FIRST_FRAME) == Some(&Value::Bool(true));
        match self {
            Frames::All => true,
            Frames::First => first,
            Frames::Later => !first,
        }
    }

    /// As plans show them.
    pub fn words(self) -> Option<&'static str> {
        match self {
            Frames::All => None,
            Frames::First => Some("in first frames"),
            Frames::Later => Some("in all frames but first ones"),
        }
    }
}

/// The frames in which a condition holds; `None`: in none.
///
/// # Errors
/// As [`Expr::truth`].
pub(super) fn frames(when: &Expr, value: &dyn Fn(&str) -> Option<Val>) -> Result<Option<Frames>, Diagnostic> {
    let mut asks = false;
    when.names(&mut |name, _| asks |= name == FIRST_FRAME);
    if !asks {
        return Ok(when.truth(value)?.then_some(Frames::All));
    }
    let holds = |first| when.truth(&|name| if name == FIRST_FRAME { Some(Val::Bool(first)) } else { value(name) });
    Ok(match (holds(true)?, holds(false)?) {
        (true, true) => Some(Frames::All),
        (true, false) => Some(Frames::First),
        (false, true) => Some(Frames::Later),
        (false, false) => None,
    })
}

impl<'g> Wirer<'g, '_> {
    /// Whether a pass may go by the frame where it stands: in a loop the loop does, and alternatives are measured.
    pub(super) fn goes_by_frames(&mut self, pass: &'g Pass, frames: Frames, loops: &[String]) -> bool {
        let Some(when) = pass.when.as_ref().filter(|_| frames != Frames::All) else { return true };
        let d = match (&pass.kind, loops.last()) {
            (PassKind::Fastest { .. }, _) => {
                let d = Diagnostic::error(format!("the alternatives of `{}` run in some frames only", pass.name.value));
                d.help("alternatives are measured in any frame: leave `first_frame` out of `when`")
            }
            (_, Some(around)) => {
                let d = Diagnostic::error(format!("`{}` runs in some frames only, in a loop", pass.name.value));
                d.help(format!("give `{around}` the condition, or a loop of its own to the pass"))
            }
            _ if self.alternative => {
                let d = Diagnostic::error(format!("`{}` runs in some frames only, as an alternative", pass.name.value));
                d.help("alternatives are measured in any frame: leave `first_frame` out of `when`")
            }
            _ if pass.only.is_some() => {
                let d = Diagnostic::error(format!("`{}` runs in some frames only, and in part", pass.name.value));
                d.help("leave `only` out, or `first_frame`")
            }
            _ => return true,
        };
        self.faults.push(d.at(&when.span, ""));
        false
    }

    /// What such a pass writes is kept where it does not run: it has to be history.
    pub(super) fn keeps(&mut self, wired: &mut Wired<'g>) {
        for i in 0..wired.uses.len() {
            let u = &mut wired.uses[i];
            if !u.mode.writes() {
                continue;
            }
            if u.mode == Mode::Write {
                u.mode = Mode::Partial;
            }
            let declared = self.sizes.declared(&u.resource);
            if declared.is_some_and(|r: &Resource| r.history) {
                continue;
            }
            let (name, of) = (&wired.pass.name, &u.resource);
            let d = Diagnostic::error(format!("`{}` runs in some frames only, and nothing keeps `{of}`", name.value));
            let d = d.at(&u.span, "").at(&name.span, "in this pass");
            self.faults.push(d.help(format!("give `{of}` `history: true`, so that other frames find it")));
        }
    }
}

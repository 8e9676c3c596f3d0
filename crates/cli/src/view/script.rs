//! Events played without a user, for tests and for pictures in the docs.
//!
//! ```ron
//! [
//!     Rest,                                       // until what is wished for is shown and nothing more comes
//!     Drag(on: "param bounces", from: (0.2, 0.5), to: (0.8, 0.5)),   // with the pointer, in shares of that part
//!     Click("variant direct"),
//!     Replace(file: "shaders/a.wgsl", text: "1.0", by: "oops"),      // as an editor saves
//!     Faults("a.wgsl:3:"),                        // until a fault, or a check in a shader, says so
//!     Replace(file: "shaders/a.wgsl", text: "oops", by: "1.0"),
//!     Mended,                                     // until there is none
//!     ClickAt(on: "image", at: (0.5, 0.5), ctrl: true), Answer("writes"),    // what a pixel's invocation computes
//!     Size(1, 1), Rest, Size(900, 600), Rest,
//!     Key(key: "Z", ctrl: true),
//!     Shot("after.png"),                          // what the window shows
//!     Save("after.ron"),                          // the choice
//!     LoseDevice,
//!     Close,
//! ]
//! ```
//!
//! Files are relative to the working folder. The parts of the window by name: `param NAME`, `reset NAME`, `variant
//! NAME`, `output NAME`, `image`, `light N`, `split line`, `against NAME`, `save picture`, `tab …`, `port NAME` (in the
//! compiled graph), `channel R`, `undo` and so on.

use super::feed::ViewState;
use super::state::PanelState;
use egui::{Event, Key, Modifiers, PointerButton, Pos2};
use lightgraph::internals::diag::{Source, render};
use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Checked, Diagnostic};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long a step may take.
const PATIENCE: Duration = Duration::from_secs(90);
/// The moves that a drag is made of.
const MOVES: usize = 12;

#[derive(Debug, Clone, PartialEq, Deserialize)]
enum WindowStep {
    Rest,
    Faults(String),
    Mended,
    Click(String),
    ClickAt {
        on: String,
        at: (f32, f32),
        #[serde(default)]
        ctrl: bool,
    },
    /// Until what an invocation that was asked computes, or why nothing is known of it, holds these words.
    Answer(String),
    Drag {
        on: String,
        from: (f32, f32),
        to: (f32, f32),
        #[serde(default)]
        button: Button,
    },
    Key {
        key: String,
        #[serde(default)]
        ctrl: bool,
    },
    Replace {
        file: PathBuf,
        text: String,
        by: String,
    },
    Size(u32, u32),
    Shot(PathBuf),
    Save(PathBuf),
    /// Until the image that the shown one is held against has come to this frame.
    Other(u32),
    /// Frames of the window.
    Wait(u32),
    /// Until a file is there.
    File(PathBuf),
    LoseDevice,
    Close,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
enum Button {
    #[default]
    Left,
    Middle,
    Right,
}

/// What only the event loop can do.
#[derive(Debug, Clone, PartialEq)]
pub enum Act {
    Nothing,
    Size(u32, u32),
    Shot(PathBuf),
    LoseDevice,
    Close,
}

/// What the window says of itself between two steps.
pub struct Moment<'a> {
    pub state: &'a PanelState,
    pub told: &'a ViewState,
    /// The last wish is what was told of, and nothing more will come.
    pub rest: bool,
    /// A window's size in pixels.
    pub size: [u32; 2],
}

/// Steps, and how far they are played.
#[derive(Debug)]
pub struct Script {
    steps: Vec<WindowStep>,
    at: usize,
    /// Events of the step that were not given yet, one frame's each.
    queue: Vec<Vec<Event>>,
    /// The step's own first frame has passed.
    begun: bool,
    waited: u32,
    since: Instant,
    /// When something was last changed: what a `Rest` tells the time since.
    changed: Instant,
    /// One line for each step that took time.
    pub log: Vec<String>,
}

impl Script {
    /// Reads a script.
    ///
    /// # Errors
    /// It can't be read, or is no list of steps.
    pub fn load(path: &Path) -> Checked<Script> {
        let source = Source::read(path)?;
        let steps: Vec<WindowStep> = ron::from_str(&source.text)
            .map_err(|e| Diagnostic::error(format!("{}:{}: {}", path.display(), e.span.start, e.code)))?;
        let now = Instant::now();
        Ok(Script { steps, at: 0, queue: vec![], begun: false, waited: 0, since: now, changed: now, log: vec![] })
    }

    pub fn is_done(&self) -> bool {
        self.at >= self.steps.len()
    }

    /// Goes on by a frame of the window: the events to give it, and what else to do.
    ///
    /// # Errors
    /// A step that does not come about, with its number.
    pub fn play(&mut self, now: &Moment) -> Checked<(Vec<Event>, Act)> {
        if let Some(events) = self.queue.pop() {
            return Ok((events, Act::Nothing));
        }
        let Some(step) = self.steps.get(self.at).cloned() else { return Ok((vec![], Act::Nothing)) };
        if self.since.elapsed() > PATIENCE {
            let faults = render(&now.told.faults);
            let message = format!("step {} of the script, {step:?}, did not come about\n{faults}", self.at + 1);
            return Err(Diagnostic::error(message.trim_end()).into());
        }
        let first = !std::mem::replace(&mut self.begun, true);
        let mut act = Act::Nothing;
        let mut events = vec![];
        let done = match &step {
            // A change makes its wish in the frame after its events, and what came of it may move parts in the next.
            WindowStep::Rest => {
                self.waited = if now.rest && !first { self.waited + 1 } else { 0 };
                self.waited > 2
            }
            WindowStep::Faults(part) => {
                let told: Vec<Diagnostic> = now.told.faults.iter().chain(&*now.told.checks).cloned().collect();
                !told.is_empty() && render(&told).contains(part.as_str())
            }
            WindowStep::Mended => now.rest && now.told.faults.is_empty() && now.told.checks.is_empty(),
            WindowStep::Other(frame) => now.told.frames[1] >= *frame && now.told.score.is_some(),
            WindowStep::Wait(frames) => {
                self.waited += 1;
                self.waited > *frames
            }
            WindowStep::File(path) => path.exists(),
            WindowStep::Click(on) => self.pointer(now, on, &[(0.5, 0.5)], PointerButton::Primary, &mut events),
            WindowStep::ClickAt { on, at, ctrl } => {
                let done = self.pointer(now, on, &[*at], PointerButton::Primary, &mut events);
                if let (true, [after, click]) = (*ctrl, &mut self.queue[..]) {
                    click.insert(0, Event::ModifiersChanged(Modifiers::COMMAND | Modifiers::CTRL));
                    after.insert(0, Event::ModifiersChanged(Modifiers::NONE));
                }
                done
            }
            WindowStep::Answer(words) => now.told.probed.as_ref().is_some_and(|probed| match &probed.answer {
                Ok(answer) => answer.to_string().contains(words.as_str()),
                Err(faults) => render(&faults.0).contains(words.as_str()),
            }),
            WindowStep::Drag { on, from, to, button } => {
                let mut way = vec![*from];
                for i in 1..=MOVES {
                    let share = i as f32 / MOVES as f32;
                    way.push((from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share));
                }
                let button = match button {
                    Button::Left => PointerButton::Primary,
                    Button::Middle => PointerButton::Middle,
                    Button::Right => PointerButton::Secondary,
                };
                self.pointer(now, on, &way, button, &mut events)
            }
            WindowStep::Key { key: name, ctrl } => {
                let Some(key) = Key::from_name(name) else {
                    return Err(Diagnostic::error(format!("the script names no key with `{name}`")).into());
                };
                let modifiers = if *ctrl { Modifiers::COMMAND | Modifiers::CTRL } else { Modifiers::NONE };
                let press = |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
                self.queue = vec![vec![press(false)]];
                events = vec![press(true)];
                true
            }
            WindowStep::Replace { file, text, by } => {
                replace(file, text, by)?;
                true
            }
            WindowStep::Size(width, height) => {
                if first {
                    act = Act::Size(*width, *height);
                }
                now.size == [*width, *height]
            }
            WindowStep::Shot(path) => {
                if first {
                    act = Act::Shot(path.clone());
                }
                !first
            }
            WindowStep::Save(path) => {
                now.state.now().save(path)?;
                true
            }
            WindowStep::LoseDevice => {
                act = Act::LoseDevice;
                true
            }
            WindowStep::Close => {
                act = Act::Close;
                true
            }
        };
        if done {
            self.finish(&step);
        }
        Ok((events, act))
    }

    fn finish(&mut self, step: &WindowStep) {
        match step {
            WindowStep::Rest | WindowStep::Faults(_) | WindowStep::Mended | WindowStep::Answer(_) => {
                let ms = self.changed.elapsed().as_secs_f64() * 1e3;
                self.log.push(format!("step {}: {step:?} after {ms:.0} ms", self.at + 1));
            }
            WindowStep::Shot(_) | WindowStep::Save(_) | WindowStep::Wait(_) => {}
            _ => {
                self.changed = Instant::now();
                self.log.push(format!("step {}: {step:?}", self.at + 1));
            }
        }
        self.at += 1;
        (self.begun, self.waited, self.since) = (false, 0, Instant::now());
    }

    /// Presses, moves along a way in shares of a part, and lets go. False while the part is not there.
    fn pointer(
        &mut self,
        now: &Moment,
        on: &str,
        way: &[(f32, f32)],
        button: PointerButton,
        events: &mut Vec<Event>,
    ) -> bool {
        let Some(rect) = now.state.marks.get(on) else { return false };
        let place = |(x, y): (f32, f32)| Pos2::new(rect.left() + x * rect.width(), rect.top() + y * rect.height());
        let press = |pos, pressed| Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE };
        let points: Vec<Pos2> = way.iter().map(|p| place(*p)).collect();
        let [start, rest @ ..] = &points[..] else { return true };
        let end = *points.last().unwrap_or(start);
        let mut frames = vec![vec![Event::PointerMoved(*start)]];
        if rest.is_empty() {
            // In one frame: a slow machine must not make a long press of it.
            frames.push(vec![press(*start, true), press(end, false)]);
        } else {
            frames.push(vec![press(*start, true)]);
            frames.extend(rest.iter().map(|p| vec![Event::PointerMoved(*p)]));
            frames.push(vec![press(end, false)]);
        }
        // Away, so that nothing stays hovered.
        frames.push(vec![Event::PointerGone]);
        frames.reverse();
        self.queue = frames;
        *events = self.queue.pop().unwrap_or_default();
        true
    }
}

fn replace(file: &Path, text: &str, by: &str) -> Checked<()> {
    let source = Source::read(file)?;
    if !source.text.contains(text) {
        return Err(Diagnostic::error(format!("the script finds no `{text}` in {}", file.display())).into());
    }
    write_atomically(file, source.text.replacen(text, by, 1).as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::choice::ViewChoice;

    fn script(text: &str) -> Script {
        let path = std::env::temp_dir().join(format!("lightgraph-script-{}-{}.ron", std::process::id(), text.len()));
        std::fs::write(&path, text).unwrap();
        let script = Script::load(&path);
        std::fs::remove_file(&path).unwrap();
        script.unwrap_or_else(|f| panic!("{f}"))
    }

    #[test]
    fn a_drag_presses_moves_and_lets_go_on_the_named_part() {
        let mut s = script("[Drag(on: \"a\", from: (0.0, 0.5), to: (1.0, 0.5)), Close]");
        let mut state = PanelState::new(ViewChoice::new("g".into(), "s".into()));
        let told = ViewState::default();
        let play = |s: &mut Script, state: &PanelState| {
            s.play(&Moment { state, told: &told, rest: true, size: [9, 9] }).unwrap()
        };
        assert_eq!(play(&mut s, &state), (vec![], Act::Nothing), "the part is not there yet");
        state.mark("a", egui::Rect::from_min_max(Pos2::new(10.0, 0.0), Pos2::new(30.0, 4.0)));
        let mut events = vec![];
        let mut act = Act::Nothing;
        while act != Act::Close {
            let (more, next) = play(&mut s, &state);
            events.extend(more);
            act = next;
        }
        assert_eq!(events[0], Event::PointerMoved(Pos2::new(10.0, 2.0)));
        assert!(matches!(events[1], Event::PointerButton { pressed: true, .. }));
        assert_eq!(events[1 + MOVES], Event::PointerMoved(Pos2::new(30.0, 2.0)));
        assert!(matches!(events[2 + MOVES], Event::PointerButton { pressed: false, .. }));
        assert!(s.is_done());
    }

    #[test]
    fn the_example_at_the_head_is_a_script() {
        let text: String = include_str!("script.rs")
            .lines()
            .skip_while(|l| *l != "//! ```ron")
            .skip(1)
            .take_while(|l| *l != "//! ```")
            .map(|l| format!("{}\n", l.trim_start_matches("//! ")))
            .collect();
        assert_eq!(script(&text).steps.len(), 18);
    }
}

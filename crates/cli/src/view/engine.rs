//! The stage on a thread of its own: the window never waits for a frame.

use super::feed::ViewState;
use super::stage::{FrameRequest, ViewStage};
use lightgraph::internals::reload::{LONGEST, TOGETHER, Watcher};
use lightgraph::{Diagnostic, Faults};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::Instant;

/// What the thread is told.
enum StageMessage {
    Wish(Box<FrameRequest>),
    Changed(BTreeSet<PathBuf>),
    End,
}

/// A running stage.
pub struct StageThread {
    send: Sender<StageMessage>,
    thread: Option<JoinHandle<()>>,
}

impl StageThread {
    /// Starts a stage. `tell` is called on its thread.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(stage: ViewStage, tell: impl FnMut(ViewState) + Send + 'static) -> Result<StageThread, Faults> {
        let (send, receive) = channel();
        let to = send.clone();
        let watcher = Watcher::new(move |files| {
            // Nobody listens any more only when the window has closed.
            let _ = to.send(StageMessage::Changed(files));
        });
        let work = move || run(stage, watcher, &receive, tell);
        let thread = std::thread::Builder::new().name("engine".into()).spawn(work);
        let thread = thread.map_err(|e| Diagnostic::error(format!("can't start a thread: {e}")))?;
        Ok(StageThread { send, thread: Some(thread) })
    }

    /// Says what is to be shown from now on. False when the thread has ended.
    pub fn wish(&self, wish: FrameRequest) -> bool {
        self.send.send(StageMessage::Wish(Box::new(wish))).is_ok()
    }
}

impl Drop for StageThread {
    /// Waits for the frame that is under way.
    fn drop(&mut self) {
        let _ = self.send.send(StageMessage::End);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run(
    mut stage: ViewStage,
    watcher: Result<Watcher, Faults>,
    receive: &Receiver<StageMessage>,
    mut tell: impl FnMut(ViewState),
) {
    let (mut watcher, mut blind) = match watcher {
        Ok(watcher) => (Some(watcher), vec![]),
        Err(f) => (None, f.0),
    };
    let mut wish: Option<Box<FrameRequest>> = None;
    let mut rest = true;
    loop {
        // The newest wish counts; those before it were overtaken.
        let mut first_change: Option<Instant> = None;
        let mut next = if rest { receive.recv().map_err(|_| TryRecvError::Disconnected) } else { receive.try_recv() };
        loop {
            match next {
                Ok(StageMessage::Wish(w)) => wish = Some(w),
                Ok(StageMessage::Changed(files)) => {
                    stage.changed(&files);
                    first_change.get_or_insert_with(Instant::now);
                }
                Ok(StageMessage::End) | Err(TryRecvError::Disconnected) => return,
                Err(TryRecvError::Empty) => break,
            }
            // Files that are saved together come to rest one after the other.
            next = match first_change {
                Some(first) if first.elapsed() < LONGEST => receive.recv_timeout(TOGETHER).map_err(|e| match e {
                    RecvTimeoutError::Timeout => TryRecvError::Empty,
                    RecvTimeoutError::Disconnected => TryRecvError::Disconnected,
                }),
                _ => receive.try_recv(),
            };
        }
        let Some(wish) = &wish else { continue };
        let mut told = stage.advance(wish, &mut tell);
        let mut came = false;
        match watcher.as_mut().map_or(Ok(false), |w| w.watch(&stage.folders(&wish.choice))) {
            Ok(again) => came = again,
            Err(f) => blind = f.0,
        }
        if came {
            stage.changed(&BTreeSet::new());
        }
        if !blind.is_empty() {
            let notices = told.notices.iter().chain(&blind).cloned().collect();
            told.notices = Arc::new(notices);
        }
        told.rest &= !came;
        rest = told.rest || told.lost;
        tell(told);
    }
}

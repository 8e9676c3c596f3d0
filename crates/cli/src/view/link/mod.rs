//! The live link: a program on this machine that has the token shows its scene in the window.
//!
//! - here: the listener, who is connected, and what there is to show
//! - `message` reads and writes the frames of the wire, within bounds of size and time
//! - `follow` makes a scene, places and a view of messages
//!
//! A window never waits for a connection: each is read by a thread of its own, and the newest state counts.

mod follow;
mod message;
#[cfg(test)]
mod tests;

use follow::Follower;
use glam::Mat4;
use lightgraph::internals::diag::tame;
use lightgraph::{Checked, Diagnostic, Scene, View};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::io;
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// What the scene of the link is called among the scenes.
pub const NAME: &str = "live link";

/// Connections that have not shown the token yet, at most: the next one ends the oldest.
const STRANGERS: usize = 8;

/// What came over the link.
#[derive(Debug, Clone, Default)]
pub struct Linked {
    /// Counts the programs that have connected.
    pub connection: u64,
    /// Who is connected.
    pub program: Option<String>,
    pub scene: Option<Arc<Scene>>,
    pub notices: Arc<Vec<Diagnostic>>,
    /// Node to world, by index, of what was moved since the scene came.
    pub places: BTreeMap<usize, Mat4>,
    pub view: Option<View>,
    /// Why the last message changed nothing.
    pub faults: Vec<Diagnostic>,
}

/// A listener.
#[derive(Debug)]
pub struct Link {
    listener: TcpListener,
    text: String,
    shared: Arc<SharedLinkState>,
}

#[derive(Debug)]
struct SharedLinkState {
    token: String,
    state: Mutex<LinkState>,
}

#[derive(Debug, Default)]
struct LinkState {
    now: Arc<Linked>,
    /// Connections that have not shown the token yet, by when they came.
    strangers: BTreeMap<u64, TcpStream>,
    /// Counts the connections.
    came: u64,
    /// The connection that is followed.
    current: Option<TcpStream>,
}

/// A place among the strangers, given up when dropped.
struct Stranger {
    shared: Arc<SharedLinkState>,
    came: u64,
}

impl Drop for Stranger {
    fn drop(&mut self) {
        self.shared.lock().strangers.remove(&self.came);
    }
}

impl Link {
    /// Listens at an address; port 0 is any that is free.
    ///
    /// # Errors
    /// The address is taken or not this machine's, or the system gives no random numbers.
    pub fn bind(address: SocketAddr) -> Checked<Link> {
        let failed = |e: &dyn std::fmt::Display| Diagnostic::error(format!("can't listen at {address}: {e}"));
        let listener = TcpListener::bind(address)
            .map_err(|e| failed(&e).help("`--link` alone takes a port of this machine that is free"))?;
        let at = listener.local_addr().map_err(|e| failed(&e))?;
        let mut bytes = [0_u8; 16];
        getrandom::fill(&mut bytes).map_err(|e| failed(&e))?;
        let token = bytes.iter().fold(String::new(), |mut token, byte| {
            // A string takes all that is written.
            let _ = write!(token, "{byte:02x}");
            token
        });
        let text = format!("lightgraph://{at}/{token}");
        Ok(Link { listener, text, shared: Arc::new(SharedLinkState { token, state: Mutex::default() }) })
    }

    /// The address and the token, as a program is given them.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// What there is to show: another one whenever something has changed.
    pub fn now(&self) -> Arc<Linked> {
        self.shared.lock().now.clone()
    }

    /// Follows whoever connects with the token; `wake` is called after each change, on another thread.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(&self, wake: impl Fn() + Clone + Send + 'static) -> Checked<()> {
        let failed = |e| Diagnostic::error(format!("can't follow the link: {e}"));
        let (listener, shared) = (self.listener.try_clone().map_err(failed)?, self.shared.clone());
        let work = move || {
            for stream in listener.incoming() {
                let Ok(stream) = stream else {
                    // Too many open files, for one: no reason to take a whole core.
                    std::thread::sleep(Duration::from_millis(100));
                    continue;
                };
                let (stranger, wake) = (shared.arrive(&stream), wake.clone());
                let Ok(stranger) = stranger else { continue };
                let serve = move || stranger.shared.clone().serve(stream, stranger, &wake);
                // Without a thread the connection is closed.
                let _ = std::thread::Builder::new().name("link".into()).spawn(serve);
            }
        };
        std::thread::Builder::new().name("links".into()).spawn(work).map_err(failed)?;
        Ok(())
    }
}

impl SharedLinkState {
    fn lock(&self) -> MutexGuard<'_, LinkState> {
        // Each change is whole before the next may panic.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A place for a connection among the strangers. Where there is none left, the oldest one is ended: whoever has the
    /// token shows it at once, so those who only wait keep nobody out.
    fn arrive(self: &Arc<Self>, stream: &TcpStream) -> io::Result<Stranger> {
        let stream = stream.try_clone()?;
        let mut state = self.lock();
        state.came += 1;
        let came = state.came;
        state.strangers.insert(came, stream);
        if state.strangers.len() > STRANGERS
            && let Some((_, oldest)) = state.strangers.pop_first()
        {
            end(&oldest);
        }
        Ok(Stranger { shared: self.clone(), came })
    }

    /// One connection, until it ends.
    fn serve(&self, stream: TcpStream, stranger: Stranger, wake: &dyn Fn()) {
        let Ok(mut wire) = message::TimedStream::new(stream) else { return };
        // Who can't show the token has been answered.
        let Some(program) = message::welcome(&mut wire, &self.token) else { return wire.end() };
        let Some(linked) = self.admit(&stranger, &program) else { return };
        wake();
        Follower::new(linked).follow(&mut wire, |linked| {
            let current = self.publish(linked);
            wake();
            current
        });
        wire.end();
    }

    /// Follows this connection from now on, in place of the one before it: a program that was lost without a word must
    /// not keep others out. Nothing where newer strangers have ended it.
    fn admit(&self, stranger: &Stranger, program: &str) -> Option<Linked> {
        let mut state = self.lock();
        let stream = state.strangers.remove(&stranger.came)?;
        if let Some(before) = state.current.replace(stream) {
            end(&before);
        }
        let (connection, program) = (state.now.connection + 1, Some(tame(program, 60)));
        let linked = Linked { connection, program, ..Linked::default() };
        state.now = Arc::new(linked.clone());
        Some(linked)
    }

    /// Changes what there is to show; false where another connection is followed.
    fn publish(&self, linked: &Linked) -> bool {
        let mut state = self.lock();
        let current = state.now.connection == linked.connection;
        if current {
            state.now = Arc::new(linked.clone());
        }
        current
    }
}

fn end(connection: &TcpStream) {
    // It may have ended by itself.
    let _ = connection.shutdown(Shutdown::Both);
}

//! Turns errors of the device into faults. wgpu panics on an uncaptured error, so every call runs in an error scope,
//! and a mailbox collects what no scope catches. A browser answers a scope later: pending answers are polled by
//! [`Gpu::answered`].

use super::device::Gpu;
use crate::diag::{Checked, Diagnostic, Faults};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::Duration;

/// What a scope caught, once the device says so.
type Answer = Pin<Box<dyn Future<Output = Option<wgpu::Error>> + Send>>;

/// What the device says outside of any scope, or later.
#[derive(Default)]
pub(super) struct Mailbox {
    /// Scopes that have ended without an answer, each with what was tried.
    open: Mutex<Vec<(String, Answer)>>,
    stray: Mutex<Vec<String>>,
    lost: Mutex<Option<Diagnostic>>,
}

impl Mailbox {
    /// A mailbox that `device` writes to from now on.
    pub(super) fn install(device: &wgpu::Device) -> Arc<Mailbox> {
        let mailbox = Arc::new(Mailbox::default());
        let to = mailbox.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            to.stray.lock().unwrap_or_else(PoisonError::into_inner).push(e.to_string());
        }));
        let to = Arc::downgrade(&mailbox);
        device.set_device_lost_callback(move |_, message| {
            // Dropping a device says so here too; then the mailbox is gone.
            if let Some(to) = to.upgrade() {
                let d = Diagnostic::error(format!("the device is lost: {message}"));
                let help =
                    "one submission ran too long, or the driver failed: lower the sizes or counts, then start again";
                to.lose(d.help(help));
            }
        });
        mailbox
    }

    fn lose(&self, why: Diagnostic) {
        self.lost.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(why);
    }

    /// Takes a device for lost that has not answered for so long.
    pub(super) fn give_up(&self, after: Duration) {
        let d = Diagnostic::error(format!("the device does not answer within {} s", after.as_secs_f32()));
        self.lose(d.help("look for a loop in a shader that does not end, or allow more time (`--timeout SECONDS`)"));
    }

    /// # Errors
    /// The device is lost, or has been given up.
    pub(super) fn lost(&self) -> Checked<()> {
        match &*self.lost.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(why) => Err(why.clone().into()),
            None => Ok(()),
        }
    }

    fn take_stray(&self) -> Vec<String> {
        std::mem::take(&mut *self.stray.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// What a scope caught, or `None` for now: then the answer is kept.
    fn ask(&self, what: &str, mut answer: Answer) -> Option<wgpu::Error> {
        match asked(&mut answer) {
            Poll::Ready(caught) => caught,
            Poll::Pending => {
                self.open().push((what.to_string(), answer));
                None
            }
        }
    }

    fn open(&self) -> MutexGuard<'_, Vec<(String, Answer)>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The faults that have come since, and whether more may come.
    fn settle(&self) -> (Vec<Diagnostic>, bool) {
        let mut faults = vec![];
        let mut open = self.open();
        open.retain_mut(|(what, answer)| match asked(answer) {
            Poll::Ready(caught) => {
                faults.extend(caught.map(|e| fault(what, &e)));
                false
            }
            Poll::Pending => true,
        });
        (faults, !open.is_empty())
    }
}

impl std::fmt::Debug for Mailbox {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Mailbox").field("stray", &self.stray).field("lost", &self.lost).finish_non_exhaustive()
    }
}

/// Nobody is woken: whoever waits for an answer asks again.
fn asked(answer: &mut Answer) -> Poll<Option<wgpu::Error>> {
    answer.as_mut().poll(&mut Context::from_waker(Waker::noop()))
}

impl Gpu {
    /// Whether the device has told of everything that it was asked to do so far. Outside of a browser it always has.
    ///
    /// # Errors
    /// What it found wrong since the last question.
    pub fn answered(&self) -> Checked<bool> {
        let (faults, more) = self.mailbox.settle();
        Faults::check(faults, !more)
    }

    /// Gives up what was asked of the device so far: [`Gpu::answered`] tells nothing of it.
    pub fn forget_answers(&self) {
        self.mailbox.open().clear();
    }
}

/// Catches the errors of everything this thread asks of the device until [`ErrorScope::end`].
pub(super) struct ErrorScope<'a> {
    gpu: &'a Gpu,
    // In the reverse order of their opening: that is the order of dropping, and scopes close from the inside.
    internal: wgpu::ErrorScopeGuard,
    validation: wgpu::ErrorScopeGuard,
    memory: wgpu::ErrorScopeGuard,
}

impl<'a> ErrorScope<'a> {
    pub(super) fn begin(gpu: &'a Gpu) -> ErrorScope<'a> {
        let memory = gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let internal = gpu.device.push_error_scope(wgpu::ErrorFilter::Internal);
        ErrorScope { gpu, internal, validation, memory }
    }

    /// The first error of each kind; `what` says what was tried, as in "can't {what}".
    ///
    /// # Errors
    /// Whatever the device found wrong since the scope began, as far as it says so at once.
    pub(super) fn end(self, what: &str) -> Checked<()> {
        let ask = |scope: wgpu::ErrorScopeGuard| self.gpu.mailbox.ask(what, Box::pin(scope.pop()));
        let caught = [self.internal, self.validation, self.memory].map(ask);
        let mut faults: Vec<Diagnostic> = caught.into_iter().flatten().map(|e| fault(what, &e)).collect();
        let stray = self.gpu.mailbox.take_stray();
        faults.extend(stray.iter().map(|e| Diagnostic::error(format!("can't {what}: {}", one_line(e)))));
        if !faults.is_empty() {
            // On a lost device everything fails; then the loss is the fault to tell.
            self.gpu.check()?;
        }
        Faults::check(faults, ())
    }
}

/// Runs `work` in a scope of its own.
///
/// # Errors
/// The device finds fault with it.
pub(super) fn scoped<T>(gpu: &Gpu, what: &str, work: impl FnOnce() -> T) -> Checked<T> {
    let scope = ErrorScope::begin(gpu);
    let value = work();
    scope.end(what)?;
    Ok(value)
}

fn fault(what: &str, e: &wgpu::Error) -> Diagnostic {
    match e {
        wgpu::Error::OutOfMemory { .. } => Diagnostic::error(format!("can't {what}: the device is out of memory"))
            .help("lower the sizes or counts of the resources, or choose another adapter"),
        wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => {
            Diagnostic::error(format!("can't {what}: {}", one_line(description)))
        }
    }
}

/// wgpu writes a chain of causes over several lines; a fault is one sentence.
fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|l| !l.is_empty() && *l != "Validation Error" && *l != "Caused by:");
    lines.collect::<Vec<_>>().join("; ").trim_end_matches('.').to_owned()
}

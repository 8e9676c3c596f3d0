//! What results were measured on. Errors of one kind of adapter are equal wherever they come from; times are of one
//! machine and compared with no other's.

use lightgraph::Gpu;
use serde::{Deserialize, Serialize};

/// A kind of machine: two hosts of equal parts are the same.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Machine {
    pub adapter: String,
    pub driver: String,
    pub backend: String,
    /// The adapter is a CPU.
    pub software: bool,
    pub cpu: String,
    pub cores: usize,
    pub os: String,
}

/// Where an entry was measured, and what else went on there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Host {
    /// Its name in the network; empty where the system does not say.
    pub name: String,
    pub machine: Machine,
    /// Processes that ran or waited, a mean over the minute before; `None` where the system does not say.
    pub load: Option<f64>,
}

impl Machine {
    /// The one that a device belongs to.
    pub fn of(gpu: &Gpu) -> Machine {
        let cpus = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = cpus.lines().find_map(|l| l.strip_prefix("model name")?.split_once(':'));
        Machine {
            adapter: gpu.info.name.clone(),
            driver: format!("{} {}", gpu.info.driver, gpu.info.driver_info),
            backend: format!("{:?}", gpu.info.backend),
            software: gpu.is_software(),
            cpu: model.map_or(std::env::consts::ARCH, |(_, m)| m.trim()).to_string(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            os: std::env::consts::OS.to_string(),
        }
    }

    /// Whether the same shader makes the same bits on both.
    pub fn rounds_as(&self, other: &Machine) -> bool {
        self.adapter == other.adapter && self.driver == other.driver
    }

    /// `ADAPTER, DRIVER; CPU, N cores`.
    pub fn shown(&self) -> String {
        format!("{}, {}; {}, {} cores", self.adapter, self.driver, self.cpu, self.cores)
    }
}

impl Host {
    /// This one, now.
    pub fn now(machine: &Machine) -> Host {
        let said = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        Host {
            name: said("/proc/sys/kernel/hostname").trim().to_string(),
            machine: machine.clone(),
            load: said("/proc/loadavg").split_whitespace().next().and_then(|l| l.parse().ok()),
        }
    }
}

// Starts the engine's worker while the page's other scripts are read.
window.startedWorker = navigator.gpu && new Worker("worker.js", { type: "module" });

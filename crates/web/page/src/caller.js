// Calls to the worker, and what it tells. Begins anew when the engine dies or doesn't answer.

const PATIENCE_MS = 30_000;

export class EngineLink {
  /// `listen` is told what comes unasked: {told}, {image} or {dead}.
  constructor(stage, listen) {
    this.stage = stage;
    this.listen = listen;
    this.waiting = new Map();
    this.next = 1;
  }

  async open() {
    this.close();
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 1;
    this.stage.replaceChildren(canvas);
    this.canvas = canvas;
    const worker = window.startedWorker ?? new Worker("worker.js", { type: "module" });
    window.startedWorker = undefined;
    this.worker = worker;
    worker.onmessage = ({ data }) => {
      if (worker !== this.worker) return;
      const waiting = this.waiting.get(data.id);
      if (waiting) {
        this.waiting.delete(data.id);
        if (data.error !== undefined) waiting.reject(new Error(data.error));
        else waiting.resolve(data.result);
      } else {
        this.listen(data);
      }
    };
    worker.onerror = (event) => this.listen({ dead: event.message || "the worker can't be loaded" });
    const offscreen = canvas.transferControlToOffscreen();
    const opened = await this.call("open", [offscreen], [offscreen]);
    this.timer = setInterval(() => this.watch(), 2000);
    return opened;
  }

  close() {
    clearInterval(this.timer);
    this.worker?.terminate();
    this.worker = undefined;
    for (const { reject } of this.waiting.values()) reject(new Error("the engine begins anew"));
    this.waiting.clear();
  }

  call(call, args = [], transfer = []) {
    return new Promise((resolve, reject) => {
      if (!this.worker) return reject(new Error("the engine is not open"));
      const id = this.next++;
      this.waiting.set(id, { resolve, reject });
      this.worker.postMessage({ id, call, args }, transfer);
    });
  }

  watch() {
    if (this.asked) {
      if (performance.now() - this.asked > PATIENCE_MS) {
        this.asked = undefined;
        this.listen({ dead: `the engine does not answer within ${PATIENCE_MS / 1000} s` });
      }
      return;
    }
    this.asked = performance.now();
    this.call("ping").then(() => (this.asked = undefined), () => (this.asked = undefined));
  }
}

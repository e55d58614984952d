/** The page: sliders for command and mass, the control loop in real time, and the drawing. */

import { Drawing } from "./drawing.js";
import { World, largestDifferences, load } from "./iowbc.js";
import { Panel } from "./panel.js";

const LONGEST_BEHIND = 0.1;
/** Time that the loop makes up for at most [s]; a slower machine shows slow motion. */
const MEASURED = 1.0;
/** Time over which the real-time factor is measured [s]. */
const LOWEST = 0.5, STEEPEST = 0.5, LYING = 2.0;
/** A robot has fallen whose base is below this part of its first height, or whose upward axis points up by less than
 * this; time until it is put up again [s]. */

class Page {
  constructor({ contract, scenes, first, mujoco, controller, golden }) {
    Object.assign(this, { scenes, mujoco, controller, golden, fallen: 0, advanced: 0, running: true });
    this.asked = [];
    const between = (act) => (value) => this.asked.push(() => act(value));
    this.panel = new Panel(contract, scenes, first, {
      scene: between((name) => this.begin(name)),
      mass: between((mass) => (this.world.mass = mass)),
      restart: between(() => this.begin(this.name)),
      pause: between(() => (this.running = !this.running)),
      check: between(() => this.check()),
    });
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    this.drawing = new Drawing(document.querySelector("canvas"), dark ? "dark" : "light");
    this.panel.checkable(golden !== null);
    this.begin(this.panel.scene);
    new ResizeObserver(() => this.drawing.resize()).observe(document.querySelector("canvas"));
    this.drawing.resize();
  }

  /** A scene from its beginning. */
  begin(name) {
    const changed = this.world?.scene !== this.scenes[name];
    this.name = name;
    if (changed) {
      this.world?.delete();
      this.world = new World(this.mujoco, this.scenes[name]);
      this.drawing.show(this.world);
      this.panel.massOf(this.world.scene.object);
    }
    this.world.reset();
    this.world.mass = this.panel.mass;
    this.controller.reset(name);
    this.fallen = 0;
    this.first = this.world.position(this.world.scene.base)[2];
  }

  /** Real time, for as long as the page is open. */
  async run() {
    let last = performance.now(), behind = 0, since = last, simulated = 0;
    for (;;) {
      const now = await new Promise(requestAnimationFrame);
      behind = Math.min(behind + (now - last) / 1000, LONGEST_BEHIND);
      last = now;
      while (this.asked.length) await this.asked.shift()();
      for (; this.running && behind >= this.controller.period; behind -= this.controller.period) {
        await this.step();
        simulated += this.controller.period;
      }
      if (!this.running) behind = 0;
      this.drawing.draw(this.world);
      if (now - since >= 1000 * MEASURED) {
        const factor = simulated / ((now - since) / 1000), forward = simulated > 0 ? this.advanced / simulated : 0;
        this.panel.tell({ factor, forward, world: this.world, running: this.running, fallen: this.fallen > 0 });
        [since, simulated, this.advanced] = [now, 0, 0];
      }
    }
  }

  /** One control period. */
  async step() {
    const { world } = this;
    const targets = await this.controller.step(world.measured(), this.panel.command);
    world.step(targets.position);
    const { base } = world.scene, rotation = world.rotation(base), { linear } = world.velocity(base);
    this.advanced += (rotation[0] * linear[0] + rotation[3] * linear[1]) * this.controller.period;
    const lies = world.position(base)[2] < LOWEST * this.first || rotation[8] < STEEPEST;
    this.fallen = lies ? this.fallen + this.controller.period : 0;
    if (this.fallen >= LYING) this.begin(this.name);
  }

  /** Holds this browser's controller against the exported one. */
  async check() {
    const largest = await largestDifferences(this.controller, this.golden);
    this.panel.agreement(Math.max(...Object.values(largest)), this.golden["input/command"].length);
    this.begin(this.name);
  }
}

const began = performance.now();
const root = document.documentElement;
try {
  const page = new Page(await load());
  root.dataset.ready = Math.round(performance.now() - began);
  await page.run();
} catch (error) {
  root.dataset.error = error.message;
  document.querySelector("#message").textContent =
    location.protocol === "file:" ? "Browsers load this page from a server only: python3 -m http.server" : error.message;
  throw error;
}

/** The page's panel: sliders, buttons and what is told beside them. */

const [VELOCITY_X, VELOCITY_Y, YAW_RATE, HEIGHT, PITCH] = [0, 1, 2, 3, 4];
/** Places of the first entries of the command C. */
const find = (selector) => document.querySelector(selector);

export class Panel {
  /**
   * `contract` gives the ranges of the command; `first`: the scene to begin in; `on`: what happens when scene, mass or a
   * button is changed.
   */
  constructor(contract, scenes, first, on) {
    this.command = [0, 0, 0, contract.commands.nominal_height, contract.commands.nominal_pitch, 0, 0, 0, 0, 0, 0];
    const nominal = [...this.command];
    const { velocity_x, velocity_y, yaw_rate, height, pitch } = contract.commands;
    this.sliders = [
      this.#slider(VELOCITY_X, "forward", "m/s", velocity_x),
      this.#slider(VELOCITY_Y, "left", "m/s", velocity_y),
      this.#slider(YAW_RATE, "turn", "rad/s", yaw_rate),
      this.#slider(HEIGHT, "height", "m", height),
      this.#slider(PITCH, "lean", "rad", pitch),
    ];
    this.massSlider = slider("mass", "mass", "kg", 0, 1, 0, (mass) => on.mass(mass));
    find("#sliders").append(...this.sliders.map((each) => each.row), this.massSlider.row);
    const choice = find("#scene");
    choice.append(...Object.entries(scenes).map(([name, { object }]) => new Option(titled(name, object), name)));
    choice.value = first;
    choice.addEventListener("change", () => on.scene(choice.value));
    find("#stand").addEventListener("click", () => this.#put(nominal));
    find("#restart").addEventListener("click", () => on.restart());
    find("#pause").addEventListener("click", () => {
      find("#pause").classList.toggle("pressed");
      on.pause();
    });
    find("#check").addEventListener("click", () => on.check());
    find("#title").textContent = `${contract.recipe} on ${contract.robot}`;
    document.title = find("#title").textContent;
    find("#message").textContent = "";
    find("main").hidden = false;
  }

  get scene() {
    return find("#scene").value;
  }

  get mass() {
    return this.massSlider.value;
  }

  #slider(place, name, unit, [low, high]) {
    return slider(name, name, unit, low, high, this.command[place], (value) => (this.command[place] = value));
  }

  #put(values) {
    this.sliders.forEach((each, place) => each.put(values[place]));
  }

  /** The range of the mass; none without an object. */
  massOf(object) {
    this.massSlider.row.hidden = object === null;
    if (object) this.massSlider.range(object.least, object.most, object.first);
  }

  checkable(possible) {
    find("#check").hidden = !possible;
  }

  /** What is measured, once a second; `forward`: the mean speed since the last time [m/s]. */
  tell({ factor, forward, world, running, fallen }) {
    const height = world.position(world.scene.base)[2];
    const clock = `${world.time.toFixed(0)} s, ${factor.toFixed(2)} × real time`;
    const moved = fallen ? "fell, and is put up again" : `forward ${forward.toFixed(2)} m/s, height ${height.toFixed(2)} m`;
    find("#told").textContent = running ? `${clock}; ${moved}` : "paused";
  }

  /** The check's figure. */
  agreement(largest, steps) {
    find("#agreement").textContent =
      `Over the ${steps} steps of the export's golden rollout this browser differs by ${largest.toExponential(1)} at most.`;
  }
}

function titled(name, object) {
  return object ? `${name}: a ${object.shape}` : `${name}: nothing`;
}

function slider(id, name, unit, low, high, value, onInput) {
  const row = document.createElement("label");
  const [title, input, shown] = ["span", "input", "output"].map((tag) => document.createElement(tag));
  title.textContent = name;
  Object.assign(input, { type: "range", id, step: "any" });
  row.append(title, input, shown);
  const tell = () => (shown.textContent = `${Number(input.value).toFixed(2)} ${unit}`);
  const put = (wanted) => {
    input.value = wanted;
    tell();
    onInput(Number(input.value));
  };
  const bounds = (least, most) => Object.assign(input, { min: least, max: most });
  input.addEventListener("input", () => put(input.value));
  bounds(low, high);
  input.value = value;
  tell();
  return {
    row,
    put,
    get value() {
      return Number(input.value);
    },
    range(least, most, first) {
      bounds(least, most);
      input.value = first;
      tell();
    },
  };
}

/** The exported controller: settle.onnx and step.onnx with the state between two steps, and the guard of its targets. */

import * as ort from "onnxruntime-web/wasm";
import { Guard } from "./guard.js";

const FORMAT = 4;

export class Controller {
  /** `contract`: contract.json; `settle` and `step`: the graphs in onnxruntime. */
  constructor(contract, settle, step) {
    if (contract.format !== FORMAT) throw new Error(`contract.json: format ${contract.format}, expected ${FORMAT}`);
    Object.assign(this, { contract, graphs: { settle, step } });
    this.period = 1 / contract.control_frequency;
    this.guard = new Guard(contract.velocity_limit, this.period);
    this.shapes = Object.fromEntries(contract.inputs.map(({ name, shape }) => [name, shape]));
    const sizes = contract.state.map(({ shape }) => shape.reduce((product, length) => product * length, 1));
    const place = contract.state.findIndex(({ name }) => name === "action");
    const from = sizes.slice(0, place).reduce((sum, size) => sum + size, 0);
    this.action = [from, from + sizes[place]];
    this.reset(Object.keys(contract.references.grasps)[0]);
  }

  /** Forget the past; `scene` chooses the base grasp and the load that the arms expect. */
  reset(scene) {
    const { grasps, loads } = this.contract.references;
    if (!(scene in grasps)) throw new Error(`no scene ${scene}; the contract has ${Object.keys(grasps).join(", ")}`);
    const [x, y, z] = grasps[scene];
    this.scene = { grasp: [x, y, z, x, -y, z], load: [loads[scene]] };
    this.state = null;
    this.guard.start();
  }

  /**
   * Joint targets for the next control period. `measured`: by the names of the contract's inputs, to which blanks are
   * added; `command`: C, (11,), rate-limited and clamped in the graph. What the graph found stays in `outputs`.
   */
  async step(measured, command) {
    const known = Object.entries({ ...measured, ...this.scene, command }).filter(([name]) => name in this.shapes);
    const given = Object.fromEntries(known);
    if (!("object_quaternion" in given)) given.object_quaternion = [1, 0, 0, 0];
    const state = this.state ?? (await this.#run("settle", this.contract.settle, given)).state;
    this.outputs = await this.#run("step", Object.keys(this.shapes), { ...given, state });
    const passed = this.guard.passed(Array.from(this.outputs.target), measured.joint_position);
    const after = this.outputs.state_next.slice();
    if (passed.held) after.set(state.slice(...this.action), this.action[0]);
    this.state = after.every(Number.isFinite) ? after : state;
    return { ...passed, action: this.outputs.action, supportReference: this.outputs.support_reference };
  }

  async #run(graph, names, given) {
    const fed = Object.fromEntries(names.map((name) => [name, this.#tensor(name, given[name])]));
    const found = await this.graphs[graph].run(fed);
    return Object.fromEntries(Object.entries(found).map(([name, tensor]) => [name, tensor.data]));
  }

  #tensor(name, values) {
    const shape = this.shapes[name], size = shape.reduce((product, length) => product * length, 1);
    const data = values ?? new Float32Array(size);
    if (data.length !== size) throw new Error(`${name}: ${data.length} values, expected ${size}`);
    return new ort.Tensor("float32", Float32Array.from(data), [1, ...shape]);
  }
}

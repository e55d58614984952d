/** The exported controller, as its contract describes it: once every control period, from sensors to joint targets. */

import * as ort from "onnxruntime-web/wasm";
import { YAW_RATE, approach, clamp, rateLimits } from "./command.js";
import { advance, wantsToMove } from "./gait.js";
import { Guard } from "./guard.js";
import { References } from "./references.js";

const FORMAT = 3;

export class Controller {
  /**
   * `contract`: contract.json; `session`: the graph in onnxruntime; `kinematics`: of arms and waist; `feasible`: the
   * map {pitch, low, high} to which commands are clamped, or null.
   */
  constructor(contract, session, kinematics, feasible) {
    if (contract.format !== FORMAT) throw new Error(`contract.json: format ${contract.format}, expected ${FORMAT}`);
    this.contract = contract;
    this.session = session;
    this.feasible = feasible;
    this.period = 1 / contract.control_frequency;
    this.largestStep = rateLimits(contract.commands.rates).map((rate) => rate * this.period);
    this.references = new References(contract, kinematics, (arms, command) => this.#posture(arms, command));
    this.guard = new Guard(contract.velocity_limit.map((limit) => limit * this.period));
    this.blank = {};
    for (const { name, shape } of contract.inputs) {
      const data = new Float32Array(shape.reduce((product, size) => product * size, 1));
      if (name === "object_quaternion") data[0] = 1;
      this.blank[name] = new ort.Tensor("float32", data, [1, ...shape]);
    }
    this.reset(Object.keys(contract.references.grasps)[0]);
  }

  /** Forget the past; `scene` chooses the base grasp and the load that the arms expect. */
  reset(scene) {
    const { grasps, loads } = this.contract.references;
    if (!(scene in grasps)) throw new Error(`no scene ${scene}; the contract has ${Object.keys(grasps).join(", ")}`);
    this.grasp = grasps[scene];
    this.load = loads[scene];
    this.starts = true;
    this.guard.start();
  }

  /**
   * Joint targets for the next control period.
   *
   * `measured`: by the names of the contract's inputs; `command`: C, (11,), clamped to the feasible map and approached at
   * the rates of training unless `limitRates` is off. What the graph was given and what it found stay in `inputs` and
   * `outputs`.
   */
  async step(measured, command, { limitRates = true } = {}) {
    await this.#advance(measured, command, limitRates);
    this.inputs = this.#inputs(measured);
    this.outputs = await this.#run(this.inputs);
    const { contract } = this;
    const target = new Array(contract.joints.length);
    contract.support.forEach((joint, i) => (target[joint] = this.outputs.support_target[i]));
    const arms = this.references.armTarget(this.reference, this.command, this.load);
    contract.interaction.forEach((joint, i) => (target[joint] = arms[i]));
    const passed = this.guard.passed(target, measured.joint_position);
    if (!passed.held) this.action = this.outputs.action;
    if (this.outputs.history_next.every(Number.isFinite)) this.history = this.outputs.history_next;
    this.headingReference += this.command[YAW_RATE] * this.period;
    this.starts = false;
    return { ...passed, action: this.outputs.action, supportReference: this.outputs.support_reference };
  }

  /** Command, references and gait clock of this step; a robot that starts is settled in its grasp. */
  async #advance(measured, wanted, limitRates) {
    const { gait } = this.contract.references;
    const limited = limitRates && !this.starts ? approach(this.command, wanted, this.largestStep) : wanted;
    this.command = clamp(limited, this.feasible);
    if (this.starts) {
      this.reference = await this.references.start(this.command, this.grasp);
      this.clock = { phase: 0, stepping: false };
      this.headingReference = Math.fround(measured.heading[0]);
      this.action = this.blank.last_action.data;
      this.history = this.blank.history.data;
      return;
    }
    this.clock = advance(this.clock, wantsToMove(this.command, gait), gait, this.period);
    this.reference = await this.references.advance(this.reference, this.command, this.grasp, this.period);
  }

  #inputs(measured) {
    return {
      ...Object.fromEntries(Object.entries(measured).filter(([name]) => name in this.blank)),
      command: this.command,
      arm_reference: this.reference.arms,
      heading_reference: [this.headingReference],
      gait: [this.clock.phase, this.clock.stepping ? 1 : 0],
      last_action: this.action,
      history: this.history,
      restart: [this.starts ? 1 : 0],
    };
  }

  async #posture(arms, command) {
    return Array.from((await this.#run({ command, arm_reference: arms })).support_reference);
  }

  async #run(inputs) {
    const fed = { ...this.blank };
    for (const [name, values] of Object.entries(inputs)) {
      const { dims, data } = this.blank[name];
      if (values.length !== data.length) throw new Error(`${name}: ${values.length} values, expected ${data.length}`);
      fed[name] = new ort.Tensor("float32", Float32Array.from(values), dims);
    }
    const found = await this.session.run(fed);
    return Object.fromEntries(Object.entries(found).map(([name, tensor]) => [name, tensor.data]));
  }
}

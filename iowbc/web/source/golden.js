/** Holds the page's controller against the golden vectors that came with the export. */

const FREE = "free";

const row = ({ shape, data }, step) => {
  const width = data.length / shape[0];
  return Array.from(data.subarray(step * width, (step + 1) * width));
};

/**
 * Plays the golden rollout: measured values and commands are the golden ones; references, gait clock, history and last
 * action are the page's own. Returns by name the largest absolute difference of whatever the graph was given and of
 * whatever it found. `onStep(step, result)` is told of every step.
 */
export async function largestDifferences(controller, golden, onStep = () => {}) {
  const largest = {}, names = Object.keys(golden), steps = golden["input/command"].shape[0];
  controller.reset(FREE);
  for (let step = 0; step < steps; step += 1) {
    const given = {};
    for (const name of names.filter((each) => each.startsWith("input/"))) {
      given[name.slice("input/".length)] = row(golden[name], step);
    }
    const { command, arm_reference, heading_reference, gait, last_action, history, restart, ...measured } = given;
    onStep(step, await controller.step(measured, command, { limitRates: false }));
    const found = { input: controller.inputs, output: controller.outputs };
    for (const name of names) {
      const [kind, port] = name.split("/");
      row(golden[name], step).forEach((expected, i) => {
        const away = Math.abs(Math.fround(found[kind][port][i]) - expected);
        largest[name] = Math.max(largest[name] ?? 0, Number.isNaN(away) ? Infinity : away);
      });
    }
  }
  return largest;
}

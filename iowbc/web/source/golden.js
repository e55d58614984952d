/** Holds the page's controller against the golden vectors that came with the export. */

const FREE = "free", INPUT = "input/", OUTPUT = "output/";

/**
 * Plays the golden rollout: measured values and commands are the golden ones, the state is the page's own. Returns by
 * name the largest absolute difference of whatever the graph found. `onStep(step, result)` is told of every step.
 */
export async function largestDifferences(controller, golden, onStep = () => {}) {
  const largest = {}, steps = golden["input/command"].length;
  const named = (prefix) => Object.keys(golden).filter((name) => name.startsWith(prefix));
  controller.reset(FREE);
  for (let step = 0; step < steps; step += 1) {
    const given = Object.fromEntries(named(INPUT).map((name) => [name.slice(INPUT.length), golden[name][step].flat(Infinity)]));
    const { command, grasp, load, ...measured } = given;
    Object.assign(controller.scene, { grasp, load });
    onStep(step, await controller.step(measured, command));
    for (const name of named(OUTPUT)) {
      golden[name][step].flat(Infinity).forEach((expected, i) => {
        const away = Math.abs(controller.outputs[name.slice(OUTPUT.length)][i] - expected);
        largest[name] = Math.max(largest[name] ?? 0, Number.isNaN(away) ? Infinity : away);
      });
    }
  }
  return largest;
}

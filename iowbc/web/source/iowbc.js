/** What a page of one's own takes: the exported controller, its simulation, and the check against its golden vectors. */

import loadMujoco from "@mujoco/mujoco";
import * as ort from "onnxruntime-web/wasm";
import { Controller } from "./controller.js";
import { readNpz } from "./npz.js";
import { World } from "./world.js";

export { Controller, World, readNpz };
export { largestDifferences } from "./golden.js";

ort.env.wasm.numThreads = 1;

async function fetched(url) {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`${url.pathname}: ${answer.status} ${answer.statusText}`);
  return answer;
}

/** Everything in a page's folder: by name; `golden` is null where there is none. */
export async function load(folder = new URL("./", import.meta.url)) {
  const at = (name) => new URL(name, folder);
  const json = async (name) => (await fetched(at(name))).json();
  const binary = async (name) => (await fetched(at(name))).arrayBuffer();
  ort.env.wasm.wasmPaths = { wasm: at("onnxruntime.wasm").href };
  const [contract, about, graph, mujoco] = await Promise.all([
    json("contract.json"),
    json("scenes.json"),
    binary("policy.onnx"),
    loadMujoco({ locateFile: () => at("mujoco.wasm").href }),
  ]);
  const session = await ort.InferenceSession.create(graph, { executionProviders: ["wasm"] });
  const feasible = about.feasible && (await readNpz(await binary(about.feasible)));
  const bounds = feasible && { pitch: feasible.pitch.data, low: feasible.low.data, high: feasible.high.data };
  const golden = about.golden && (await readNpz(await binary(about.golden)));
  const controller = new Controller(contract, session, about.kinematics, bounds);
  return { contract, scenes: about.scenes, first: about.first, mujoco, controller, golden };
}

/** What a page of one's own takes: the exported controller, its simulation, and the check against its golden vectors. */

import loadMujoco from "@mujoco/mujoco";
import * as ort from "onnxruntime-web/wasm";
import { Controller } from "./controller.js";
import { World } from "./world.js";

export { Controller, World };
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
  const [contract, about, settle, step, mujoco] = await Promise.all([
    json("contract.json"),
    json("scenes.json"),
    binary("settle.onnx"),
    binary("step.onnx"),
    loadMujoco({ locateFile: () => at("mujoco.wasm").href }),
  ]);
  const session = (graph) => ort.InferenceSession.create(graph, { executionProviders: ["wasm"] });
  const controller = new Controller(contract, await session(settle), await session(step));
  return { contract, ...about, mujoco, controller };
}

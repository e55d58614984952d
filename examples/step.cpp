// An exported controller with onnxruntime's C++ interface: `step FOLDER [STEPS]`.
//
// settle.onnx gives the first state, and step.onnx the joint targets and the next state, 50 times a second. This robot
// stands still in its default posture; on a robot, the measurements come from its sensors before each step, and the
// targets [rad] go to the joints' PD loops. Prints those of the last step and the mean time of a step.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <onnxruntime_cxx_api.h>

// A graph for one robot, with a buffer for each input and output, so that a step allocates none.
struct Graph {
  Ort::Session session;
  std::map<std::string, std::vector<float>> values;
  std::vector<const char*> inputs, outputs;
  std::vector<Ort::Value> given, made;

  Graph(Ort::Env& env, const std::string& file, const Ort::SessionOptions& options)
      : session(env, file.c_str(), options) {
    Ort::AllocatorWithDefaultOptions names;
    for (size_t i = 0; i < session.GetInputCount(); ++i)
      bind(session.GetInputNameAllocated(i, names).get(), session.GetInputTypeInfo(i), inputs, given);
    for (size_t i = 0; i < session.GetOutputCount(); ++i)
      bind(session.GetOutputNameAllocated(i, names).get(), session.GetOutputTypeInfo(i), outputs, made);
  }

  void bind(const char* name, const Ort::TypeInfo& type, std::vector<const char*>& names, std::vector<Ort::Value>& to) {
    std::vector<int64_t> shape = type.GetTensorTypeAndShapeInfo().GetShape();
    int64_t size = shape[0] = 1;  // robots
    for (int64_t length : shape) size *= length;
    auto& [key, buffer] = *values.emplace(name, std::vector<float>(size)).first;
    names.push_back(key.c_str());
    const auto memory = Ort::MemoryInfo::CreateCpu(OrtDeviceAllocator, OrtMemTypeCPU);
    to.push_back(Ort::Value::CreateTensor<float>(memory, buffer.data(), size, shape.data(), shape.size()));
  }

  void run() {
    session.Run({}, inputs.data(), given.data(), given.size(), outputs.data(), made.data(), made.size());
  }
};

// Copies into a buffer, which has to stay where it is.
void set(std::vector<float>& buffer, const std::vector<float>& from) {
  std::copy_n(from.begin(), std::min(from.size(), buffer.size()), buffer.begin());
}

int main(int count, char** words) try {
  if (count < 2) throw std::invalid_argument("give an exported folder, and how many steps if not 500");
  const std::string folder = words[1];
  const int steps = count > 2 ? std::stoi(words[2]) : 500;
  Ort::Env env(ORT_LOGGING_LEVEL_WARNING);
  Ort::SessionOptions options;
  options.SetIntraOpNumThreads(1);
  Graph settle(env, folder + "/settle.onnx", options), step(env, folder + "/step.onnx", options);
  auto& values = step.values;

  Ort::AllocatorWithDefaultOptions text;
  const Ort::ModelMetadata about = step.session.GetModelMetadata();
  std::istringstream posture(about.LookupCustomMetadataMapAllocated("default_joint_pos", text).get());
  for (float& angle : values["joint_position"]) (posture >> angle).ignore();
  set(values["grasp"], {0.3f, 0.16f, 0.12f, 0.3f, -0.16f, 0.12f});  // references.grasps.free of contract.json, mirrored
  values["command"][3] = 0.72f;  // pelvis height [m]
  values["projected_gravity"][2] = -1.0f;
  if (values.count("object_quaternion")) values["object_quaternion"][0] = 1.0f;

  for (const char* name : settle.inputs) set(settle.values[name], values[name]);
  settle.run();
  set(values["state"], settle.values["state"]);
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < steps; ++i) {
    step.run();
    set(values["state"], values["state_next"]);
  }
  const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - begin;
  for (float target : values["target"]) std::printf("%.6f ", target);
  std::printf("\n%d steps of %.3f ms\n", steps, passed.count() / steps);
} catch (const std::exception& error) {
  return std::fprintf(stderr, "step: %s\n", error.what()), 1;
}

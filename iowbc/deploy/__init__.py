"""The exported controller: ONNX export, contract, and the runtime without torch."""

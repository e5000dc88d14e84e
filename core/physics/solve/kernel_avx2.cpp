#include "core/physics/solve/kernel_body.inl"

namespace tessera::physics {

const Kernels& KernelsAvx2() { return kKernels; }

}  // namespace tessera::physics

#include "core/physics/solve/kernel_body.inl"

namespace tessera::physics {

const Kernels& KernelsSse2() { return kKernels; }

}  // namespace tessera::physics

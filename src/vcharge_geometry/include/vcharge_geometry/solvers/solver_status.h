#pragma once

namespace vcharge {

/// What a minimal solver says of its input. Solutions exist only with kOk, and even then there may be none.
enum class SolverStatus {
  kOk,
  kNotFinite,   ///< NaN or infinity in the input
  kDegenerate,  ///< the constraints depend on each other: equal correspondences, collinear points, ...
};

}  // namespace vcharge

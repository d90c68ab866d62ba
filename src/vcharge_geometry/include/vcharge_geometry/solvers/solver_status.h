#pragma once

namespace vcharge {

/// Status of a minimal solver. Solutions exist only for kOk, possibly none.
enum class SolverStatus {
  kOk,
  kNotFinite,   ///< NaN or infinity in the input
  kDegenerate,  ///< linearly dependent constraints: equal correspondences, collinear points, ...
};

}  // namespace vcharge

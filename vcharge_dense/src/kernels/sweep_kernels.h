#pragma once

#include <cstddef>
#include <cstdint>

#include "vcharge_dense/plane_sweep_options.h"

// The inner loops of the plane sweep, compiled once per instruction set (Google Highway) and chosen at run
// time. Pixels lie in the order of a TileLayout with as many lanes as the chosen set has; all arrays of
// pixels are aligned for it (hwy::AllocateAligned) and hold whole vectors.
//
// Gray levels are integers from the sampling to the window's sums, so that running sums do not drift and all
// instruction sets agree.
namespace vcharge {

/// Fraction bits of image positions in fixed point.
constexpr int kPositionBits = 16;
/// A cell of a PackedImage that no sample may use.
constexpr int32_t kUnseenCell = static_cast<int32_t>(0x80808080u);
/// Weights of a bilinear sample sum up to this in each direction.
constexpr int kWeightSum = 255;
/// Scores are kept as integers: this is the correlation 1, kNoScore where nobody votes.
constexpr float kScoreScale = 32000.0f;
constexpr int16_t kNoScore = -32768;
/// A neighbour's vote for a hypothesis: kVote plus its correlation times kVoteScale, 0 where it does not
/// vote. A sum of up to 32 votes tells their number and the sum of their correlations.
constexpr int kVoteBits = 24;
constexpr int32_t kVote = 1 << kVoteBits;
constexpr float kVoteScale = 262144.0f;

/// Integers for which the sums of a window fit into 32 bits, and a single unseen sample shows in them.
struct SampleScale {
  int shift = 0;             ///< sample = (gray levels times kWeightSum squared) >> shift
  int32_t unseen = 0;        ///< stands for a sample that is not seen
  float max_squares = 0.0f;  ///< a window whose sum of squares about the mean is larger has unseen samples
  float min_squares = 0.0f;  ///< a window below counts as constant

  static SampleScale forWindow(int window_px);
  /// Of one pixel, as the kernels sample it.
  int32_t sample(int gray) const;
};

/// Where points of the reference's rays fall in a neighbour, in pixels of its PackedImage (paper, Camera
/// Model; a point has an image while cos(angle to the axis) > -1/xi or > -xi).
struct Projection {
  float fx, fy, cx, cy, xi;  ///< of the working camera, the centre with the packed image's margin
  float min_x, min_y;        ///< positions from these ...
  float max_x, max_y;        ///< ... to these may be sampled
  float rotation[9];         ///< neighbour from reference, row-major
  float translation[3];
};

/// Points rotation * ray + (base + offset * weight) * translation.
struct RayRow {
  const float* x;
  const float* y;
  const float* z;
  const float* base;  ///< inverse range, per metre
  const float* weight;
  float offset;
};

/// Coefficients of a cell of the node grid, each a vector of floats in fixed point's unit. Along a row u
/// takes the values start, start + first, start + 2 first + second... with increments that grow by `second`;
/// each of the three is a polynomial c0 + c1 row + c2 row^2. First the nine of u, then those of v.
constexpr int kCellCoefficients = 18;

/// How much neighbouring nodes differ, at most over both directions and coordinates: passes over nodes
/// without an image.
struct NodeDifferences {
  float second = 0.0f;
  float third = 0.0f;
};

/// One row of a tile against one neighbour.
struct CorrelationRow {
  const float* cells = nullptr;  ///< [cell][kCellCoefficients][lanes]; null: positions are given per pixel
  int cell_shift = 0;            ///< a cell is 1 << cell_shift columns wide
  int row_in_cell = 0;
  const int32_t* u = nullptr;  ///< [strip][lanes]
  const int32_t* v = nullptr;
  const int32_t* image = nullptr;  ///< PackedImage
  int pitch = 0;                   ///< of its rows, in cells

  int strip = 0;
  int window = 0;
  SampleScale scale;
  const int32_t* reference_pairs = nullptr;  ///< samples of this row, and less those one window above
  /// The neighbour's samples of this row, and of one window above, in the kernel's own order; room for
  /// rowSamples().
  int16_t* samples = nullptr;
  const int16_t* old_samples = nullptr;
  int32_t* column_sums = nullptr;  ///< [strip][3][lanes]: of b, b^2 and a b over one window of rows
  /// Of the windows that end in this row and start in each column: mean and kVoteScale / sqrt(sum of squares
  /// about it).
  const float* reference_mean = nullptr;
  const float* vote_per_covariance = nullptr;
  int32_t* votes = nullptr;   ///< [strip][lanes]; null: no window ends here
  uint8_t* voters = nullptr;  ///< bits of the lanes, rowVoterBytes()
};

/// The neighbours' votes in one row.
struct VoteRow {
  Aggregation aggregation = Aggregation::kMean;
  int best_k = 1;
  int num_neighbours = 0;
  const bool* after = nullptr;     ///< per neighbour
  const int32_t* votes = nullptr;  ///< [neighbour][strip][lanes]
  size_t neighbour_stride = 0;     ///< of votes
  /// Not more than 0 where the reference's window does not count.
  const float* vote_per_covariance = nullptr;
  int strip = 0;
  int16_t* scores = nullptr;  ///< [strip][lanes]
  uint8_t* voters = nullptr;  ///< of the neighbours, rowVoterBytes() each; those who do not count are cleared
  size_t voter_stride = 0;    ///< bytes from one neighbour's voters to the next one's
};

/// Two highest separate peaks over the hypotheses, per pixel. Scores beside the first one are kNoScore where
/// there are none.
struct Peaks {
  int16_t* best;  ///< hypothesis, -1 where nobody voted for any
  int16_t* score;
  int16_t* before;
  int16_t* after;
  int16_t* second;  ///< hypothesis, -1 where there is none
  int16_t* second_score;
};

/// A neighbour and how well its pose relative to the reference is known.
struct NeighbourUncertainty {
  Projection projection;
  float rotation_variance_rad2;
  float translation_variance_m2;
  bool after;  ///< taken after the reference: a random walk errs independently on the two sides
};

/// One row of pixels: at least as many as the chosen set has lanes; nothing needs to be aligned.
struct UncertaintyRow {
  size_t count = 0;
  const float* ray_x = nullptr;
  const float* ray_y = nullptr;
  const float* ray_z = nullptr;
  const float* inverse_range = nullptr;
  const NeighbourUncertainty* neighbours = nullptr;
  int num_neighbours = 0;
  // Only for the standard deviation:
  const int32_t* voters = nullptr;  ///< bit n: neighbour n
  const float* score = nullptr;
  const float* curvature = nullptr;
  float noise_factor = 0.0f;  ///< times what the score leaves unexplained, over its curvature, is a variance
  float matching_noise_px = 0.0f;
  float scale_noise = 0.0f;  ///< of all baselines alike
};

/// The neighbourhood of each pixel of a row: `rows` point at its first pixel's column, in images with a
/// margin as wide as the shifts. At least as many pixels as the chosen set has lanes.
struct NeighbourhoodRow {
  size_t count = 0;
  const float* const* rows = nullptr;
  int num_rows = 0;
  int max_shift = 0;  ///< columns from -max_shift to max_shift ...
  int shift_step = 1;
  const float* middle = nullptr;
  const float* tolerance = nullptr;
};

/// The kernels of one instruction set.
struct SweepKernels {
  int lanes;
  /// Positions of `count` points, NaN where they have no image in the packed image.
  void (*project)(const Projection& projection, const RayRow& rays, size_t count, float* u, float* v);
  /// The same in fixed point, 0 where there is no image: the packed image's corner, which is unseen.
  void (*projectFixed)(const Projection& projection, const RayRow& rays, size_t count, int32_t* u,
                       int32_t* v);
  /// Cells over three rows of nodes, which are `spacing` pixels apart; each covers two steps in both
  /// directions. A cell with a node that has no image is unseen. nodes: per strip, odd.
  /// [cell][kCellCoefficients][lanes].
  void (*makeCells)(const float* const* u_rows, const float* const* v_rows, int nodes, int spacing,
                    float* cells);
  NodeDifferences (*nodeDifferences)(const float* u, const float* v, int node_rows, int nodes);
  void (*correlate)(const CorrelationRow& row);
  void (*vote)(const VoteRow& row);
  /// Scores are [hypothesis][pixel], `stride` apart.
  void (*findPeaks)(const int16_t* scores, size_t stride, int num_hypotheses, size_t num_pixels,
                    const Peaks& peaks);
  /// Number and sum of the neighbours within the tolerance of the middle; NaN is not.
  void (*sumAgreeing)(const NeighbourhoodRow& row, float* number, float* sum);
  /// Pixels per 1/m that the image of each point moves by, in the neighbour where it is most.
  void (*largestMotion)(const UncertaintyRow& row, float* motion);
  /// Standard deviation of each inverse range, infinite where the voters say nothing and NaN where there is
  /// none (see estimateRange()).
  void (*inverseRangeSigma)(const UncertaintyRow& row, float* sigma);
};

/// Of the best instruction set that the machine has.
SweepKernels sweepKernels();

/// Room for the samples of one row of one neighbour.
inline size_t rowSamples(int lanes, int strip) {
  return static_cast<size_t>(strip + strip % 2) * static_cast<size_t>(lanes);
}

/// Bytes of the voters' bits of one row of one neighbour.
inline size_t rowVoterBytes(int lanes, int strip) {
  return static_cast<size_t>(strip) * static_cast<size_t>(lanes < 8 ? 1 : lanes / 8);
}

}  // namespace vcharge

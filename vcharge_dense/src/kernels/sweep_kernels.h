#pragma once

#include <cstddef>
#include <cstdint>

#include "vcharge_dense/plane_sweep_options.h"

// The inner loops of the plane sweep, compiled once per instruction set with Google Highway and selected at
// run time. Pixels are in the order of a TileLayout with the selected set's number of lanes; arrays of pixels
// are AlignedArrays of whole vectors.
//
// Gray levels are integers from sampling to the sums over windows, so that running sums do not drift and all
// instruction sets agree.
namespace vcharge {

/// Fraction bits of image positions in fixed point.
constexpr int kPositionBits = 16;
/// Value of a cell in a PackedImage that must not be sampled.
constexpr int32_t kUnseenCell = static_cast<int32_t>(0x80808080u);
/// Sum of the weights of a bilinear sample in each direction.
constexpr int kWeightSum = 255;
/// Scores are integers: a correlation times kScoreScale, or kNoScore where no neighbour votes.
constexpr float kScoreScale = 32000.0f;
constexpr int16_t kNoScore = -32768;
/// A neighbour's vote for a hypothesis: kVote plus its correlation times kVoteScale, or 0 where it does not
/// vote. The sum of up to 32 votes contains their number and the sum of their correlations.
constexpr int kVoteBits = 24;
constexpr int32_t kVote = 1 << kVoteBits;
constexpr float kVoteScale = 262144.0f;

/// Two rows of an image and of its mask.
struct PixelRows {
  const uint8_t* top;
  const uint8_t* bottom;
  const uint8_t* top_valid;
  const uint8_t* bottom_valid;
};

/// Scale of integer samples at which the sums of a window fit into 32 bits and reveal a single unseen sample.
struct SampleScale {
  int shift = 0;             ///< sample = (gray level - 128) * kWeightSum^2 >> shift
  int32_t unseen = 0;        ///< value of a sample that is not seen
  float max_squares = 0.0f;  ///< windows with a larger sum of squares about the mean have unseen samples
  float min_squares = 0.0f;  ///< windows with smaller sums are constant

  static SampleScale forWindow(int window_px);
  /// Sample of a pixel with this gray level.
  int32_t sample(int gray) const;
};

/// An Exposure in single precision.
struct LineMotion {
  bool lines_are_columns;
  float times_s[4];
  float velocity[3], turn_rate[3];
};

/// Projects points on the reference's rays into a neighbour's PackedImage (paper, section Camera Model). A
/// point is visible where the cosine of its angle to the axis exceeds -1/xi (xi > 1) or -xi.
struct Projection {
  float fx, fy, cx, cy, xi;  ///< working camera, with the packed image's margin added to the centre
  float min_x, min_y;        ///< lowest x and y that may be sampled
  float max_x, max_y;        ///< highest x and y that may be sampled
  float rotation[9];         ///< neighbour from reference, row-major
  float translation[3];
  bool is_moving;        ///< whether the rest is used: cameras move while their lines are exposed
  float reference_xi;    ///< of the reference's camera
  LineMotion reference;  ///< of the reference, with the neighbour's axes
  LineMotion neighbour;  ///< likewise, with the velocity of a reference that turns with it
};

/// Rays and inverse ranges of points: rotation * ray + (base + offset * weight) * translation in the
/// neighbour.
struct RayRow {
  const float* x;
  const float* y;
  const float* z;
  const float* base;  ///< inverse range, per metre
  const float* weight;
  float offset;
};

/// Fraction bits of a StepTable's pixels per step, and the largest number of steps to each side, after which
/// their rounding is 0.02 pixels.
constexpr int kStepBits = 11, kMaxStepReach = 8;

/// Positions of points in a neighbour whose inverse range grows in equal steps, as the quadratic through
/// those at three steps.
struct StepTable {
  int32_t* u;  ///< at step 0, in fixed point; 0, the unseen corner, where one of the three is invisible
  int32_t* v;
  int32_t* u_steps;  ///< low half: pixels per step, high half: pixels per squared step
  int32_t* v_steps;
};

/// Coefficients of a cell of the node grid, each a vector of floats in the unit of fixed-point positions.
/// Along a row u takes the values start, start + first, start + 2 first + second, ... with increments that
/// grow by `second`; each of the three is a polynomial c0 + c1 row + c2 row^2. Nine coefficients for u, then
/// nine for v.
constexpr int kCellCoefficients = 18;

/// Largest second and third differences between neighbouring nodes over both directions and coordinates;
/// without nodes that are not visible.
struct NodeDifferences {
  float second = 0.0f;
  float third = 0.0f;
};

/// Inputs and outputs for one row of a tile and one neighbour.
struct CorrelationRow {
  const float* cells = nullptr;  ///< [cell][kCellCoefficients][lanes]; null: u and v are given per pixel
  int cell_shift = 0;            ///< a cell is 1 << cell_shift columns wide
  int row_in_cell = 0;
  const int32_t* u = nullptr;  ///< [strip][lanes]
  const int32_t* v = nullptr;
  const int32_t* image = nullptr;  ///< cells of a PackedImage
  int pitch = 0;                   ///< number of cells from one row to the next

  int strip = 0;
  int window = 0;
  SampleScale scale;
  const int32_t* reference_pairs = nullptr;  ///< samples of this row, and negated one window above
  /// The neighbour's samples of this row and of the row one window above, in the kernel's own order, with
  /// rowSamples() elements.
  int16_t* samples = nullptr;
  const int16_t* old_samples = nullptr;
  int32_t* column_sums = nullptr;  ///< [strip][3][lanes]: sums of b, b^2 and a b over one window of rows
  /// For the windows that end in this row and start in each column: mean and kVoteScale / sqrt(sum of squares
  /// about the mean).
  const float* reference_mean = nullptr;
  const float* vote_per_covariance = nullptr;
  int32_t* votes = nullptr;   ///< [strip][lanes]; null: no window ends in this row
  uint8_t* voters = nullptr;  ///< one bit per lane, rowVoterBytes() bytes
};

/// Inputs and outputs for combining the neighbours' votes in one row.
struct VoteRow {
  Aggregation aggregation = Aggregation::kMean;
  int num_neighbours = 0;
  const bool* after = nullptr;     ///< per neighbour: taken after the reference
  const int32_t* votes = nullptr;  ///< layout [neighbour][strip][lanes]
  size_t neighbour_stride = 0;     ///< elements from one neighbour's votes to the next one's
  /// 0 or less where the reference's window is not used.
  const float* vote_per_covariance = nullptr;
  int strip = 0;
  int16_t* scores = nullptr;  ///< [strip][lanes]
  uint8_t* voters = nullptr;  ///< rowVoterBytes() per neighbour; cleared where a vote is not used
  size_t voter_stride = 0;    ///< bytes from one neighbour's voters to the next one's
};

/// The two highest separate peaks over the hypotheses, per pixel. `before` and `after` are the scores on both
/// sides of the first peak, kNoScore where there are none.
struct Peaks {
  int16_t* best;  ///< index of the hypothesis, -1 if no neighbour voted for any
  int16_t* score;
  int16_t* before;
  int16_t* after;
  int16_t* second;  ///< index of the hypothesis, -1 if there is none
  int16_t* second_score;
};

/// A neighbour and the variances of its pose relative to the reference.
struct NeighbourUncertainty {
  Projection projection;
  float rotation_variance_rad2;
  float translation_variance_m2;
  bool after;  ///< taken after the reference; errors before and after it are independent
};

/// One row of pixels, at least as many as a vector has lanes; pointers need not be aligned.
struct UncertaintyRow {
  size_t count = 0;
  const float* ray_x = nullptr;
  const float* ray_y = nullptr;
  const float* ray_z = nullptr;
  const float* inverse_range = nullptr;
  const NeighbourUncertainty* neighbours = nullptr;
  int num_neighbours = 0;
  // Only for the standard deviation:
  const int32_t* voters = nullptr;  ///< bit n: neighbour n contributed
  const float* score = nullptr;
  const float* curvature = nullptr;
  float noise_factor = 0.0f;  ///< variance = noise_factor * (1 - score) / curvature
  float matching_noise_px = 0.0f;
  float scale_noise = 0.0f;  ///< relative error common to all baselines
};

/// The neighbourhoods of at least as many pixels as a vector has lanes. `rows` point at the first pixel's
/// column, in images whose margins are as wide as the shifts.
struct NeighbourhoodRow {
  size_t count = 0;
  const float* const* rows = nullptr;
  int num_rows = 0;
  int max_shift = 0;  ///< largest shift in columns, to both sides
  int shift_step = 1;
  const float* middle = nullptr;
  const float* tolerance = nullptr;
};

/// The kernels of one instruction set.
struct SweepKernels {
  int lanes;
  /// Makes `count` cells of a PackedImage from one pixel more.
  void (*packCells)(const PixelRows& rows, size_t count, int32_t* cells);
  /// Positions of `count` points, NaN where they are not visible in the packed image.
  void (*project)(const Projection& projection, const RayRow& rays, size_t count, float* u, float* v);
  /// Like project(), in fixed point; 0, the unseen corner of the packed image, for invisible points.
  void (*projectFixed)(const Projection& projection, const RayRow& rays, size_t count, int32_t* u,
                       int32_t* v);
  /// Writes the quadratics through the positions that `rays` gives at its offset and at `reach` times
  /// `step` less and more. They are unseen, too, where a step is 16 pixels or more.
  void (*makeSteps)(const Projection& projection, const RayRow& rays, float step, int reach, size_t count,
                    const StepTable& table);
  /// Positions of `count` points after this number of steps.
  void (*walkSteps)(const StepTable& table, int steps, size_t count, int32_t* u, int32_t* v);
  /// Computes cells, [cell][kCellCoefficients][lanes], over three rows of `nodes` nodes per strip (odd),
  /// which are `spacing` pixels apart. A cell covers two steps in both directions; it is unseen if one of
  /// its nodes is not visible.
  void (*makeCells)(const float* const* u_rows, const float* const* v_rows, int nodes, int spacing,
                    float* cells);
  NodeDifferences (*nodeDifferences)(const float* u, const float* v, int node_rows, int nodes);
  void (*correlate)(const CorrelationRow& row);  ///< the faster one of the next two, which give the same
  void (*correlateByGathers)(const CorrelationRow& row);
  void (*correlateByLoads)(const CorrelationRow& row);
  void (*vote)(const VoteRow& row);
  /// `scores`: [hypothesis][pixel], `stride` elements from one hypothesis to the next.
  void (*findPeaks)(const int16_t* scores, size_t stride, int num_hypotheses, size_t num_pixels,
                    const Peaks& peaks);
  /// Number and sum of the neighbours that differ from the middle by at most the tolerance, never of NaN.
  void (*sumAgreeing)(const NeighbourhoodRow& row, float* number, float* sum);
  /// Motion of each point's image in pixels per 1/m of inverse range, in the neighbour where it is largest.
  void (*largestMotion)(const UncertaintyRow& row, float* motion);
  /// Standard deviation of each inverse range: infinite where the voters do not constrain it, NaN where there
  /// is no inverse range (see estimateRange()).
  void (*inverseRangeSigma)(const UncertaintyRow& row, float* sigma);
};

/// Kernels of the best instruction set of this machine; of AVX2 at most where the environment has
/// VCHARGE_INSTRUCTIONS=avx2. Throws std::invalid_argument for another value.
SweepKernels sweepKernels();

/// Number of samples that one row of one neighbour takes.
inline size_t rowSamples(int lanes, int strip) {
  return static_cast<size_t>(strip + strip % 2) * static_cast<size_t>(lanes);
}

/// Bytes that the voter bits of one row of one neighbour take.
inline size_t rowVoterBytes(int lanes, int strip) {
  return static_cast<size_t>(strip) * static_cast<size_t>(lanes < 8 ? 1 : lanes / 8);
}

}  // namespace vcharge

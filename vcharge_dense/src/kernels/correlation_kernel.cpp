#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/correlation_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
//
#include <hwy/highway.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <vector>

#include "kernels/lane_operations-inl.h"
#include "kernels/sweep_kernels.h"
#include "kernels/sweep_kernels_internal.h"

HWY_BEFORE_NAMESPACE();
namespace vcharge {
namespace HWY_NAMESPACE {
namespace {

/// Bilinear samples of a PackedImage at fixed-point positions.
template <bool kLoadEach>
struct Sampler {
  const int32_t* image;
  int scale_shift;
  VI high_half, pitch, unseen_cell, unseen_sample, flip_bytes, flip_low;
  MI all_lanes;

  explicit HWY_INLINE Sampler(const CorrelationRow& row)
      : image(row.image),
        scale_shift(row.scale.shift),
        high_half(hn::Set(DI(), -65536)),
        pitch(hn::Set(DI(), row.pitch << 16 | 1)),
        unseen_cell(hn::Set(DI(), kUnseenCell)),
        unseen_sample(hn::Set(DI(), row.scale.unseen)),
        flip_bytes(hn::Set(DI(), 0x00ff00ff)),
        flip_low(hn::Set(DI(), 0x000000ff)),
        all_lanes(hn::Gt(hn::Set(DI(), row.strip), hn::Zero(DI()))) {}

  HWY_INLINE VI index(VI u, VI v) const {
    static_assert(kPositionBits == 16, "a position's whole pixels are the high half");
    const VI column = hn::BitCast(DI(), hn::ShiftRight<16>(hn::BitCast(hn::Repartition<uint32_t, DI>(), u)));
    return multiplyHalves(hn::OrAnd(column, v, high_half), pitch);
  }
  HWY_INLINE VI operator()(VI u, VI v) const {
    VI cells;
    if constexpr (kLoadEach) {
      cells = loadEach(image, index(u, v));
    } else {
      cells = gather(image, index(u, v), all_lanes);
    }
    // Weights 255 - f and f, where f is the highest eight bits of the fraction.
    const VI weights_y = hn::Xor(fractionBytes(v), flip_bytes);
    const VI weights_x = hn::Xor(fractionHalves(u), flip_low);
    const VI columns = multiplyBytes(weights_y, cells);
    const VI sample = hn::ShiftRightSame(multiplyHalves(columns, weights_x), scale_shift);
    return hn::IfThenElse(hn::Eq(cells, unseen_cell), unseen_sample, sample);
  }
};

struct Sums {
  VI b, bb, ab;

  HWY_INLINE void add(const int32_t* column) {
    const DI di;
    const size_t lanes = hn::Lanes(di);
    b = hn::Add(b, hn::LoadU(di, column));
    bb = hn::Add(bb, hn::LoadU(di, column + lanes));
    ab = hn::Add(ab, hn::LoadU(di, column + 2 * lanes));
  }
  HWY_INLINE void subtract(const int32_t* column) {
    const DI di;
    const size_t lanes = hn::Lanes(di);
    b = hn::Sub(b, hn::Load(di, column));
    bb = hn::Sub(bb, hn::Load(di, column + lanes));
    ab = hn::Sub(ab, hn::Load(di, column + 2 * lanes));
  }
};

/// 1 / sqrt with at least 14 correct bits.
HWY_INLINE VF reciprocalRoot(VF value) {
  const DF df;
  const VF estimate = hn::ApproximateReciprocalSqrt(value);
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  return estimate;
#else
  // One step of Newton's method.
  const VF half = hn::Mul(hn::Mul(hn::Set(df, 0.5f), value), estimate);
  return hn::Mul(estimate, hn::NegMulAdd(half, estimate, hn::Set(df, 1.5f)));
#endif
}

/// Computes votes by zero-mean normalized cross-correlation from the sums of windows.
struct Correlator {
  const float* HWY_RESTRICT mean;
  const float* HWY_RESTRICT vote_per_covariance;
  int32_t* HWY_RESTRICT votes;
  uint8_t* HWY_RESTRICT voters;
  VF inverse_count, min_squares, max_squares;

  explicit HWY_INLINE Correlator(const CorrelationRow& row)
      : mean(row.reference_mean),
        vote_per_covariance(row.vote_per_covariance),
        votes(row.votes),
        voters(row.voters),
        inverse_count(hn::Set(DF(), 1.0f / static_cast<float>(row.window * row.window))),
        min_squares(hn::Set(DF(), row.scale.min_squares)),
        max_squares(hn::Set(DF(), row.scale.max_squares)) {}

  HWY_INLINE void operator()(const Sums& sums, size_t vector) const {
    const DF df;
    const DI di;
    const size_t at = vector * hn::Lanes(df);
    const VF b = hn::ConvertTo(df, sums.b);
    const VF squares = hn::NegMulAdd(hn::Mul(b, inverse_count), b, hn::ConvertTo(df, sums.bb));
    const VF covariance = hn::NegMulAdd(hn::Load(df, mean + at), b, hn::ConvertTo(df, sums.ab));
    const VF vote =
        hn::Mul(hn::Mul(covariance, hn::Load(df, vote_per_covariance + at)), reciprocalRoot(squares));
    const auto seen = hn::And(hn::Gt(squares, min_squares), hn::Lt(squares, max_squares));
    const VI counted = hn::Add(nearest(vote), hn::Set(di, kVote));
    hn::Store(hn::IfThenElseZero(hn::RebindMask(di, seen), counted), di, votes + at);
    hn::StoreMaskBits(df, seen, voters + vector * rowVoterBytes(static_cast<int>(hn::Lanes(df)), 1));
  }
};

constexpr size_t kMaxBlock = 16;  // vectors sampled at a time; at least the width of a cell

/// Steps through the positions along a row, cell by cell.
struct CellWalk {
  const float* cell;
  VF row;
  VI u, v, du, dv, ddu, ddv;

  HWY_INLINE VI polynomial(size_t i) const {
    const DF df;
    const float* c = cell + 3 * i * hn::Lanes(df);
    const VF outer = hn::MulAdd(row, hn::Load(df, c + 2 * hn::Lanes(df)), hn::Load(df, c + hn::Lanes(df)));
    return nearest(hn::MulAdd(row, outer, hn::Load(df, c)));
  }
  HWY_INLINE void enterCell() {
    u = polynomial(0);
    du = polynomial(1);
    ddu = polynomial(2);
    v = polynomial(3);
    dv = polynomial(4);
    ddv = polynomial(5);
    cell += kCellCoefficients * hn::Lanes(DF());
  }
  HWY_INLINE void advance() {
    u = hn::Add(u, du);
    v = hn::Add(v, dv);
    du = hn::Add(du, ddu);
    dv = hn::Add(dv, ddv);
  }
};

#if HWY_TARGET == HWY_SCALAR
HWY_INLINE void storeSamples(VI even, VI odd, int16_t* to) {
  to[0] = static_cast<int16_t>(hn::GetLane(even));
  to[1] = static_cast<int16_t>(hn::GetLane(odd));
}
template <int kVector>
HWY_INLINE VI samplePairs(const int16_t* now, const int16_t* old) {
  const uint32_t high = static_cast<uint32_t>(static_cast<int32_t>(old[kVector])) << 16;
  return hn::Set(DI(), static_cast<int32_t>(high | static_cast<uint16_t>(now[kVector])));
}
#else
using D16 = hn::Repartition<int16_t, DI>;
/// Packs two vectors of samples into one; each block of 128 bits holds the first vector's lanes first.
HWY_INLINE void storeSamples(VI even, VI odd, int16_t* to) {
  const D16 d16;
  hn::Store(hn::ReorderDemote2To(d16, even, odd), d16, to);
}
/// Unpacks one of two packed vectors: samples of two rows become the low and the high halves of lanes.
template <int kVector>
HWY_INLINE VI samplePairs(const int16_t* now, const int16_t* old) {
  const D16 d16;
  const auto low = hn::Load(d16, now), high = hn::Load(d16, old);
  return hn::BitCast(
      DI(), kVector == 0 ? hn::InterleaveLower(d16, low, high) : hn::InterleaveUpper(d16, low, high));
}
#endif

/// Samples a row, two vectors at a time (see storeSamples()). Separate from the sums, which would otherwise
/// wait in the processor's queues for a gather.
template <bool kFromCells, bool kLoadEach>
class BlockSampler {
 public:
  HWY_INLINE BlockSampler(const CorrelationRow& row, const Sampler<kLoadEach>& sample)
      : sample_(sample),
        u_(row.u),
        v_(row.v),
        samples_(row.samples),
        walk_{row.cells, hn::Set(DF(), static_cast<float>(row.row_in_cell)), {}, {}, {}, {}, {}, {}} {}

  /// Samples the vectors `first` to `end`, an even number of them, from the next cell.
  HWY_INLINE void sample(size_t first, size_t end) {
    const DI di;
    const size_t lanes = hn::Lanes(di);
    if constexpr (kFromCells) {
      walk_.enterCell();
      CellWalk walk = walk_;
      for (size_t s = first; s < end; s += 2) {
        const VI even = sample_(walk.u, walk.v);
        walk.advance();
        const VI odd = sample_(walk.u, walk.v);
        walk.advance();
        storeSamples(even, odd, samples_ + s * lanes);
      }
    } else {
      for (size_t at = first * lanes; at < end * lanes; at += 2 * lanes) {
        const VI even = sample_(hn::Load(di, u_ + at), hn::Load(di, v_ + at));
        const VI odd = sample_(hn::Load(di, u_ + at + lanes), hn::Load(di, v_ + at + lanes));
        storeSamples(even, odd, samples_ + at);
      }
    }
  }

 private:
  const Sampler<kLoadEach>& sample_;
  const int32_t* u_;
  const int32_t* v_;
  int16_t* HWY_RESTRICT samples_;
  CellWalk walk_;
};

/// Running sums along a row, over the windows that end in it.
template <bool kWithVotes>
class RowSums {
 public:
  explicit HWY_INLINE RowSums(const CorrelationRow& row)
      : correlate_(row),
        columns_(row.column_sums),
        reference_pairs_(row.reference_pairs),
        window_(static_cast<size_t>(row.window)),
        strip_(static_cast<size_t>(row.strip)),
        sums_{hn::Zero(DI()), hn::Zero(DI()), hn::Zero(DI())} {}

  /// Adds the new sample of a column and subtracts the one a window height above: the two halves of `pair`.
  HWY_INLINE void add(size_t s, VI pair) {
    const DI di;
    const size_t lanes = hn::Lanes(di);
    const VI new_less_old = hn::Set(di, static_cast<int32_t>(0xffff0001u));  // the 16-bit halves are 1 and -1
    int32_t* column = columns_ + 3 * s * lanes;
    const VI b = addHalves(hn::Load(di, column), pair, new_less_old);
    const VI bb = addHalves(hn::Load(di, column + lanes), pair, negateHighHalf(pair));
    const VI ab =
        addHalves(hn::Load(di, column + 2 * lanes), pair, hn::Load(di, reference_pairs_ + s * lanes));
    hn::Store(b, di, column);
    hn::Store(bb, di, column + lanes);
    hn::Store(ab, di, column + 2 * lanes);
    if constexpr (kWithVotes) {
      sums_.b = hn::Add(sums_.b, b);
      sums_.bb = hn::Add(sums_.bb, bb);
      sums_.ab = hn::Add(sums_.ab, ab);
      if (s + 1 >= window_) {
        correlate_(sums_, s + 1 - window_);
        sums_.subtract(columns_ + 3 * (s + 1 - window_) * lanes);
      }
    }
  }
  /// Windows across the end of a strip continue in the first columns of the next lane's strip.
  HWY_INLINE void finish() {
    const size_t lanes = hn::Lanes(DI());
    for (size_t s = 0; kWithVotes && s + 1 < window_; ++s) {
      const size_t start = strip_ + s + 1 - window_;
      sums_.add(columns_ + 3 * s * lanes + 1);
      correlate_(sums_, start);
      sums_.subtract(columns_ + 3 * start * lanes);
    }
  }

 private:
  const Correlator correlate_;
  int32_t* HWY_RESTRICT columns_;
  const int32_t* HWY_RESTRICT reference_pairs_;
  const size_t window_, strip_;
  Sums sums_;
};

template <bool kFromCells, bool kWithVotes, bool kLoadEach>
void correlateRow(const CorrelationRow& row) {
  const size_t lanes = hn::Lanes(DI());
  const Sampler<kLoadEach> sample(row);
  BlockSampler<kFromCells, kLoadEach> blocks(row, sample);
  RowSums<kWithVotes> sums(row);
  const auto strip = static_cast<size_t>(row.strip);
  const size_t block_size = kFromCells ? size_t{1} << row.cell_shift : kMaxBlock;
  const int16_t* HWY_RESTRICT new_samples = row.samples;
  const int16_t* HWY_RESTRICT old_samples = row.old_samples;
  for (size_t first = 0; first < strip; first += block_size) {
    const size_t end = HWY_MIN(first + block_size, strip);
    blocks.sample(first, end + (end - first) % 2);
    for (size_t s = first; s < end; s += 2) {
      sums.add(s, samplePairs<0>(new_samples + s * lanes, old_samples + s * lanes));
      if (s + 1 < end) {
        sums.add(s + 1, samplePairs<1>(new_samples + s * lanes, old_samples + s * lanes));
      }
    }
  }
  sums.finish();
}

template <bool kLoadEach>
void correlateTarget(const CorrelationRow& row) {
  if (row.cells != nullptr) {
    row.votes != nullptr ? correlateRow<true, true, kLoadEach>(row)
                         : correlateRow<true, false, kLoadEach>(row);
  } else {
    row.votes != nullptr ? correlateRow<false, true, kLoadEach>(row)
                         : correlateRow<false, false, kLoadEach>(row);
  }
}

/// Shortest time, in nanoseconds, that sampling a few rows takes.
template <bool kLoadEach>
int64_t samplingTime_ns() {
  constexpr int kStrip = 64, kRows = 8, kRounds = 8;
  const DI di;
  const int pitch = kStrip * static_cast<int>(hn::Lanes(di)) + 1;
  const std::vector<int32_t> image(static_cast<size_t>(pitch * kRows), 1);
  CorrelationRow row;
  row.image = image.data();
  row.pitch = pitch;
  row.strip = kStrip;
  row.scale = SampleScale::forWindow(kMatchingWindow_px);
  const Sampler<kLoadEach> sample(row);
  const VI pixel = hn::Set(di, 1 << kPositionBits);
  int64_t shortest = std::numeric_limits<int64_t>::max();
  VI sum = hn::Zero(di);
  for (int round = 0; round < kRounds; ++round) {
    const auto start = std::chrono::steady_clock::now();
    VI v = hn::Zero(di);
    for (int y = 0; y < kRows; ++y) {
      VI u = hn::Mul(hn::Iota(di, 0), hn::Set(di, kStrip << kPositionBits));
      for (int s = 0; s < kStrip; ++s) {
        sum = hn::Add(sum, sample(u, v));
        u = hn::Add(u, pixel);
      }
      v = hn::Add(v, pixel);
    }
    [[maybe_unused]] const volatile int32_t used = hn::GetLane(sum);  // so that the sum is computed
    const auto passed = std::chrono::steady_clock::now() - start;
    shortest = std::min<int64_t>(shortest, std::chrono::nanoseconds(passed).count());
  }
  return shortest;
}

}  // namespace

void fillCorrelationKernels(SweepKernels* kernels) {
  static const bool load_each = samplingTime_ns<true>() < samplingTime_ns<false>();
  kernels->correlateByGathers = &correlateTarget<false>;
  kernels->correlateByLoads = &correlateTarget<true>;
  kernels->correlate = load_each ? kernels->correlateByLoads : kernels->correlateByGathers;
}

}  // namespace HWY_NAMESPACE
}  // namespace vcharge
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcharge {

HWY_EXPORT(fillCorrelationKernels);

void addCorrelationKernels(SweepKernels* kernels) {
  HWY_DYNAMIC_DISPATCH(fillCorrelationKernels)(kernels);
}

}  // namespace vcharge
#endif

// Every reader of untrusted bytes accepts valid input, and accepts or rejects damaged input without crashing.
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "fuzz_target.h"

namespace vcharge {
namespace {

constexpr int kDamagedPerSeed = 150;

/// Typical damage: flipped bits, wrong bytes, missing or repeated parts, huge numbers.
std::string damage(std::string bytes, std::mt19937* generator) {
  const auto below = [&](size_t size) { return size == 0 ? 0 : (*generator)() % size; };
  static const char* const kPieces[] = {"-1",
                                        "1e308",
                                        "nan",
                                        ".inf",
                                        "99999999999999999999",
                                        "[",
                                        "}",
                                        ": ",
                                        "\n",
                                        "\xff\xff\xff\xff",
                                        "\x7f\xff\xff\xff",
                                        "&a *a"};
  const size_t num_changes = 1 + below(4);
  for (size_t i = 0; i < num_changes && !bytes.empty(); ++i) {
    const size_t at = below(bytes.size());
    switch (below(6)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
        break;
      case 1:
        bytes[at] = static_cast<char>(below(256));
        break;
      case 2:
        bytes.erase(at, 1 + below(16));
        break;
      case 3:
        bytes.insert(at, bytes.substr(below(bytes.size()), 1 + below(64)));
        break;
      case 4: {
        const std::string piece = kPieces[below(std::size(kPieces))];
        bytes.replace(at, std::min(piece.size(), bytes.size() - at), piece);
        break;
      }
      default:
        bytes.resize(at);
    }
  }
  return bytes;
}

class FuzzTest : public testing::TestWithParam<size_t> {};

TEST_P(FuzzTest, TakesWhatIsRightAndSurvivesWhatIsDamaged) {
  const FuzzTarget& target = fuzzTargets()[GetParam()];
  std::mt19937 generator(11);
  int num_refused = 0;
  for (const std::string& seed : target.seeds()) {
    EXPECT_TRUE(take(target, seed)) << target.name;
    for (int i = 0; i < kDamagedPerSeed; ++i) {
      const std::string damaged = damage(seed, &generator);
      try {
        num_refused += take(target, damaged) ? 0 : 1;
      } catch (const std::exception& error) {
        ADD_FAILURE() << target.name << ", damaged text " << i << ": " << error.what();
      }
    }
  }
  // Readers without a checksum or a syntax accept anything.
  if (target.name != "can" && target.name != "camera_frame") {
    EXPECT_GT(num_refused, 0) << target.name;
  }
}

std::string nameOf(const testing::TestParamInfo<size_t>& target) {
  return fuzzTargets()[target.param].name;
}

INSTANTIATE_TEST_SUITE_P(Readers, FuzzTest, testing::Range<size_t>(0, fuzzTargets().size()), nameOf);

}  // namespace
}  // namespace vcharge

// Entry points of libFuzzer. FUZZ_TARGET=NAME selects the reader; with FUZZ_SEEDS=FOLDER, it only writes its
// seeds.
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>

#include "fuzz_target.h"

namespace {

const vcharge::FuzzTarget* target = nullptr;

void writeSeeds(const std::string& folder) {
  int number = 0;
  for (const std::string& seed : target->seeds()) {
    std::ofstream(folder + "/seed" + std::to_string(number++), std::ios::binary)
        .write(seed.data(), static_cast<std::streamsize>(seed.size()));
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* const name = std::getenv("FUZZ_TARGET");
  if (name == nullptr) {
    for (const vcharge::FuzzTarget& entry : vcharge::fuzzTargets()) {
      std::cout << entry.name << "\n";
    }
    std::exit(0);
  }
  target = &vcharge::fuzzTarget(name);
  if (const char* const folder = std::getenv("FUZZ_SEEDS")) {
    writeSeeds(folder);
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  vcharge::take(*target, std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}

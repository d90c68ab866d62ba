#!/usr/bin/env bash
# Builds the library's tests with AddressSanitizer (with leaks) and UndefinedBehaviorSanitizer, and runs them; a folder
# for the build may be named. Odometry's test is left out: it needs the simulator.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
build=${1:-$(mktemp -d)}
flags=(-std=c++17 -g -O1 -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer
  -Iinclude -I../src/vcharge_core/include -I/usr/include/eigen3 -I/usr/include/opencv4)
core=(../src/vcharge_core/src/{file_io,multi_frame_synchronizer,options,rigid_transform,timestamp}.cpp)
library=(src/{can_reader,can_wheel_decoder,clock_map,driver_options,folder_frame_source,gray_converter,trigger_grouper}.cpp
  src/{v4l2_description,v4l2_device,v4l2_frame_source,wheel_odometry}.cpp)
tests=(src/{can_reader,can_wheel_decoder,clock_map,gray_converter,trigger_grouper,v4l2_device,v4l2_frame_source}_test.cpp)
g++ "${flags[@]}" -fPIC -shared emulator/*.cpp -o "$build/libemulator.so" -lturbojpeg -lpthread -ldl
g++ "${flags[@]}" "${library[@]}" "${tests[@]}" "${core[@]}" -L"$build" -lemulator -lturbojpeg -lyaml-cpp -lgtest \
  -lgtest_main -lgmock -lopencv_core -lopencv_imgproc -lopencv_imgcodecs -lpthread -Wl,-rpath,"$build" -o "$build/sanitized_test"
ASAN_OPTIONS=detect_leaks=1 "$build/sanitized_test"

#include <spdlog/spdlog.h>
#include <nanoflann.hpp>

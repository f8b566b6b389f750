// Times cuSPARSE's batched tridiagonal solvers on the systems of one axis of a picture, and checks their solutions.
//
// gtsv WIDTH HEIGHT PLANES FACTOR ROUNDS CIRCLES
//
// CIRCLES holds WIDTH x HEIGHT diameters, f32, row by row. Each row of each plane is a system of WIDTH unknowns:
// (1 + b[i-1] + b[i]) y[i] - b[i-1] y[i-1] - b[i] y[i+1] = x[i], b[i] = FACTOR * min(|c[i]|, |c[i+1]|)^2.
// cuSPARSE has no batch with shared matrices, so every plane brings its own copy of them. One line of JSON a solver.

#include <cuda_runtime.h>
#include <cusparse.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

struct Failure {
    std::string what;
};

void check(cudaError_t error, const char* what) {
    if (error != cudaSuccess) throw Failure{std::string(what) + ": " + cudaGetErrorString(error)};
}

void check(cusparseStatus_t status, const char* what) {
    if (status != CUSPARSE_STATUS_SUCCESS)
        throw Failure{std::string(what) + ": status " + std::to_string(static_cast<int>(status))};
}

// Device memory that goes when its owner goes.
struct Buffer {
    void* data = nullptr;
    explicit Buffer(size_t bytes) { check(cudaMalloc(&data, std::max<size_t>(bytes, 1)), "cudaMalloc"); }
    ~Buffer() { cudaFree(data); }
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;
    float* floats() const { return static_cast<float*>(data); }
};

struct Event {
    cudaEvent_t event = nullptr;
    Event() { check(cudaEventCreate(&event), "cudaEventCreate"); }
    ~Event() { cudaEventDestroy(event); }
    Event(const Event&) = delete;
    Event& operator=(const Event&) = delete;
};

// The systems, row after row: lower, middle, upper, right-hand side.
struct Systems {
    size_t unknowns, count;
    std::vector<float> part[4];
};

Systems systems(const std::vector<float>& circles, size_t width, size_t height, size_t planes, double factor) {
    Systems s;
    s.unknowns = width;
    s.count = height * planes;
    for (auto& part : s.part) part.resize(s.unknowns * s.count);
    uint32_t random = 12345;
    for (size_t line = 0; line < s.count; ++line) {
        const float* c = &circles[(line % height) * width];
        auto link = [&](size_t i) {
            const double least = std::min(std::fabs(c[i]), std::fabs(c[i + 1]));
            return static_cast<float>(factor * least * least);
        };
        for (size_t i = 0; i < width; ++i) {
            const float before = i == 0 ? 0.0f : link(i - 1);
            const float after = i + 1 == width ? 0.0f : link(i);
            random = random * 1664525u + 1013904223u;
            const size_t at = line * width + i;
            s.part[0][at] = -before;
            s.part[1][at] = 1.0f + before + after;
            s.part[2][at] = -after;
            s.part[3][at] = static_cast<float>(random >> 8) / 16777216.0f;
        }
    }
    return s;
}

// Element i of system j at i * count + j.
std::vector<float> interleaved(const std::vector<float>& rows, size_t unknowns, size_t count) {
    std::vector<float> out(rows.size());
    const size_t tile = 64;
    for (size_t j0 = 0; j0 < count; j0 += tile)
        for (size_t i = 0; i < unknowns; ++i)
            for (size_t j = j0; j < std::min(count, j0 + tile); ++j) out[i * count + j] = rows[j * unknowns + i];
    return out;
}

// Largest difference from elimination in double, of some lines of the whole batch.
double largest_error(const Systems& s, const std::vector<float>& y, bool interleaved_batch) {
    const size_t n = s.unknowns;
    const size_t step = std::max<size_t>(1, s.count / 257);
    double largest = 0.0;
    std::vector<double> upper(n), value(n);
    for (size_t line = 0; line < s.count; line += step) {
        const size_t at = line * n;
        for (size_t i = 0; i < n; ++i) {
            const double lower = s.part[0][at + i];
            const double pivot = s.part[1][at + i] - (i ? lower * upper[i - 1] : 0.0);
            upper[i] = s.part[2][at + i] / pivot;
            value[i] = (s.part[3][at + i] - (i ? lower * value[i - 1] : 0.0)) / pivot;
        }
        for (size_t i = n - 1; i-- > 0;) value[i] -= upper[i] * value[i + 1];
        for (size_t i = 0; i < n; ++i) {
            const double found = interleaved_batch ? y[i * s.count + line] : y[at + i];
            const double error = std::fabs(found - value[i]);
            // Not a number is an error, too.
            largest = error <= largest ? largest : (std::isfinite(error) ? error : 1e30);
        }
    }
    return largest;
}

// One solver: strided (algorithm < 0) or interleaved with an algorithm.
void measure(cusparseHandle_t handle, const Systems& s, int algorithm, int rounds, const char* name) {
    const bool inter = algorithm >= 0;
    const size_t values = s.unknowns * s.count, bytes = values * sizeof(float);
    const int m = static_cast<int>(s.unknowns), count = static_cast<int>(s.count);
    Buffer dl(bytes), d(bytes), du(bytes), x(bytes), right(bytes);
    const Buffer* parts[4] = {&dl, &d, &du, &x};
    // The interleaved solvers overwrite the matrices; what they were comes back from here, outside the times.
    std::vector<float> host[4];
    for (int i = 0; i < 4; ++i) host[i] = inter ? interleaved(s.part[i], s.unknowns, s.count) : s.part[i];
    check(cudaMemcpy(right.data, host[3].data(), bytes, cudaMemcpyHostToDevice), "right-hand sides");
    auto restore = [&](bool first) {
        if (first || inter)
            for (int i = 0; i < 3; ++i)
                check(cudaMemcpy(parts[i]->data, host[i].data(), bytes, cudaMemcpyHostToDevice), "matrices");
        check(cudaMemcpy(x.data, right.data, bytes, cudaMemcpyDeviceToDevice), "right-hand sides");
    };
    restore(true);
    size_t work_bytes = 0;
    if (inter)
        check(cusparseSgtsvInterleavedBatch_bufferSizeExt(handle, algorithm, m, dl.floats(), d.floats(),
                  du.floats(), x.floats(), count, &work_bytes), "buffer size");
    else
        check(cusparseSgtsv2StridedBatch_bufferSizeExt(handle, m, dl.floats(), d.floats(), du.floats(),
                  x.floats(), count, m, &work_bytes), "buffer size");
    Buffer work(work_bytes);
    Event begin, end;
    std::vector<float> times;
    for (int round = 0; round <= rounds; ++round) {
        if (round > 0) restore(false);
        check(cudaDeviceSynchronize(), "before");
        check(cudaEventRecord(begin.event, nullptr), "event");
        if (inter)
            check(cusparseSgtsvInterleavedBatch(handle, algorithm, m, dl.floats(), d.floats(), du.floats(),
                      x.floats(), count, work.data), "solver");
        else
            check(cusparseSgtsv2StridedBatch(handle, m, dl.floats(), d.floats(), du.floats(), x.floats(),
                      count, m, work.data), "solver");
        check(cudaEventRecord(end.event, nullptr), "event");
        check(cudaEventSynchronize(end.event), "solver");
        float elapsed = 0.0f;
        check(cudaEventElapsedTime(&elapsed, begin.event, end.event), "event");
        // The first round warms up.
        if (round > 0) times.push_back(elapsed);
    }
    std::vector<float> y(values);
    check(cudaMemcpy(y.data(), x.data, bytes, cudaMemcpyDeviceToHost), "solutions");
    std::sort(times.begin(), times.end());
    std::printf("{\"solver\": \"%s\", \"ms\": %.6f, \"buffer_bytes\": %zu, \"largest_error\": %.3e}\n", name,
                times[times.size() / 2], work_bytes, largest_error(s, y, inter));
    std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 7) {
        std::fprintf(stderr, "gtsv WIDTH HEIGHT PLANES FACTOR ROUNDS CIRCLES\n");
        return 2;
    }
    const size_t width = std::strtoull(argv[1], nullptr, 10), height = std::strtoull(argv[2], nullptr, 10);
    const size_t planes = std::strtoull(argv[3], nullptr, 10);
    const double factor = std::strtod(argv[4], nullptr);
    const int rounds = std::max(1, std::atoi(argv[5]));
    std::vector<float> circles(width * height);
    std::FILE* file = std::fopen(argv[6], "rb");
    const bool whole = file && width > 1 && height > 0 && planes > 0 &&
                       std::fread(circles.data(), sizeof(float), circles.size(), file) == circles.size();
    if (file) std::fclose(file);
    if (!whole) {
        std::fprintf(stderr, "cannot read %zu x %zu diameters from %s\n", width, height, argv[6]);
        return 2;
    }
    try {
        cusparseHandle_t handle = nullptr;
        check(cusparseCreate(&handle), "cusparseCreate");
        const Systems s = systems(circles, width, height, planes, factor);
        const struct {
            const char* name;
            int algorithm;
        } solvers[] = {{"gtsv2StridedBatch", -1},
                       {"gtsvInterleavedBatch, algo 0 (Thomas)", 0},
                       {"gtsvInterleavedBatch, algo 1 (LU)", 1},
                       {"gtsvInterleavedBatch, algo 2 (QR)", 2}};
        for (const auto& solver : solvers) {
            try {
                measure(handle, s, solver.algorithm, rounds, solver.name);
            } catch (const Failure& failure) {
                std::printf("{\"solver\": \"%s\", \"error\": \"%s\"}\n", solver.name, failure.what.c_str());
                std::fflush(stdout);
                // Clears what was not sticky.
                cudaGetLastError();
            }
        }
        cusparseDestroy(handle);
    } catch (const Failure& failure) {
        std::fprintf(stderr, "%s\n", failure.what.c_str());
        return 1;
    }
    return 0;
}

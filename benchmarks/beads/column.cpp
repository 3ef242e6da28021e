// Run a column of beads that only push against a wall, by velocity Verlet.
// column EXPONENT HARD BEADS STEP prints 1 - eta, the time of the last contact and the seconds taken.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

int main(int, char **arguments) {
    const double p = atof(arguments[1]), h = atof(arguments[4]);
    const bool hard = atoi(arguments[2]);
    const long n = atol(arguments[3]);
    const int fourfold = 4 * p == std::floor(4 * p) ? int(4 * p) : 0;
    auto push = [&](double d) {
        switch (fourfold) {
            case 5: return d * std::sqrt(std::sqrt(d));
            case 6: return d * std::sqrt(d);
            case 7: return d * std::sqrt(d) * std::sqrt(std::sqrt(d));
            case 8: return d * d;
            case 10: return d * d * std::sqrt(d);
            case 12: return d * d * d;
            default: return std::pow(d, p);
        }
    };
    std::vector<double> s(n, 0.0), v(n, -1.0), f(n + 1, 0.0);  // s[0] is the gap to the wall.
    auto step = [&](double k) {
        for (long i = 0; i < n; ++i) v[i] += 0.5 * k * (f[i] - f[i + 1]);
        s[0] += k * v[0];
        for (long i = 1; i < n; ++i) s[i] += k * (v[i] - v[i - 1]);
        for (long i = hard ? 1 : 0; i < n; ++i) f[i] = s[i] < 0 ? push(-s[i]) : 0.0;
        for (long i = 0; i < n; ++i) v[i] += 0.5 * k * (f[i] - f[i + 1]);
    };
    // No part of the column that contains bead 1 moves to the wall.
    auto leaves = [&] {
        double momentum = 0;
        for (long i = 0; i < n; ++i) if ((momentum += v[i]) < 0) return false;
        return true;
    };
    const clock_t begun = clock();
    double last = 0;
    if (hard) v[0] = 1.0;
    for (double t = 0;; t += h) {
        const double speed = v[0] - 0.5 * h * f[1];
        if (hard && speed < 0 && s[0] + h * speed < 0) {
            double x = -s[0] / v[0];  // The contact inside the step, by Newton's method.
            for (int k = 0; k < 30; ++k)
                x -= (s[0] + x * (v[0] - 0.5 * f[1] * x)) / (v[0] - f[1] * x);
            step(x);
            s[0] = 0;
            v[0] = -v[0];
            step(h - x);
            last = t;
        } else step(h);
        if (!hard && s[0] < 0) last = t;
        if (s[0] > 0 && t > 1.2 * last + 50 && leaves()) break;
    }
    double mean = 0;
    for (double x : v) mean += x / n;
    std::printf("%.15f %.3f %.6f\n", 1 - mean * mean, last, double(clock() - begun) / CLOCKS_PER_SEC);
}

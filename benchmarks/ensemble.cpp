// Throws of one disc in still air, eight at a time: what plain C++ makes of the same equations.
//
// The model, the axes, the fixed steps of RK4 and the landing are those of
// disc_sim_ros/physics/kernels (equations.py, aerodynamics.py, rk4.py, batch.py), without wind,
// control inputs and choice of model. benchmarks/ensemble.py builds it, calls `fly_all` and
// compares the landings.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace {

constexpr int lanes = 8;
using Vector = double __attribute__((vector_size(8 * lanes)));
using Mask = std::int64_t __attribute__((vector_size(8 * lanes)));

double pick(bool condition, double a, double b) { return condition ? a : b; }
Vector pick(Mask condition, Vector a, Vector b) { return condition ? a : b; }
double root(double x) { return std::sqrt(x); }
Vector root(Vector x)
{
    Vector result;
    for (int i = 0; i < lanes; ++i) result[i] = std::sqrt(x[i]);
    return result;
}
template <class T> T size_of(T x) { return pick(x < 0.0, -x, x); }
template <class T> T greater(T a, T b) { return pick(a > b, a, b); }

template <class T> struct State {
    T X, Y, Z, VX, VY, VZ, e0, e1, e2, e3, p, q, r, sigma;
};

constexpr int numbers = 14;

template <class T> State<T> axpy(const State<T> & s, double h, const State<T> & k)
{
    return {s.X + h * k.X, s.Y + h * k.Y, s.Z + h * k.Z, s.VX + h * k.VX, s.VY + h * k.VY,
        s.VZ + h * k.VZ, s.e0 + h * k.e0, s.e1 + h * k.e1, s.e2 + h * k.e2, s.e3 + h * k.e3,
        s.p + h * k.p, s.q + h * k.q, s.r + h * k.r, s.sigma + h * k.sigma};
}

struct Row {
    double alpha, C_Lift, C_Drag, C_M, end, C_Lift_alpha, C_Drag_alpha, C_M_alpha;
};

template <class T> struct Coefficients {
    T Lift, Drag, M;
};

}  // namespace

extern "C" struct Disc {  // as benchmarks/ensemble.py fills it
    double m, c, S, I_x, I_z, C_Lp, C_Mq, C_Nr, rho, g;
    const Row * table;
    std::int64_t rows;
};

namespace {

const Row & row_at(double alpha, const Disc & disc)
{
    const double last = disc.rows - 2.0;
    const double first = disc.table[0].alpha;
    const double share = (alpha - first) * (last + 1.0) / (disc.table[disc.rows - 1].alpha - first);
    auto i = static_cast<std::int64_t>(std::min(std::max(share, 0.0), last));
    while (alpha < disc.table[i].alpha && i > 0) --i;
    while (alpha >= disc.table[i].end && i < last) ++i;
    return disc.table[i];
}

Coefficients<double> coefficients(double alpha, const Disc & disc)
{
    const Row & row = row_at(alpha, disc);
    const double d = alpha - row.alpha;
    return {row.C_Lift + row.C_Lift_alpha * d, row.C_Drag + row.C_Drag_alpha * d,
        row.C_M + row.C_M_alpha * d};
}

Coefficients<Vector> coefficients(Vector alpha, const Disc & disc)
{
    Coefficients<Vector> C;
    for (int i = 0; i < lanes; ++i) {
        const Row & row = row_at(alpha[i], disc);
        const double d = alpha[i] - row.alpha;
        C.Lift[i] = row.C_Lift + row.C_Lift_alpha * d;
        C.Drag[i] = row.C_Drag + row.C_Drag_alpha * d;
        C.M[i] = row.C_M + row.C_M_alpha * d;
    }
    return C;
}

template <class T> T arctangent(T y, T x)  // x >= 0; as equations.arctangent
{
    constexpr double low = 0.41421356237309515, high = 2.414213562373095;
    const T zero = x * 0.0;
    const T a = size_of(y);
    const auto steep = a > high * x;
    const auto flat = a <= low * x;
    const T above = pick(steep, -x, pick(flat, a, a - x));
    const T below = pick(steep, a, pick(flat, x, a + x));
    const T base = pick(steep, zero + M_PI / 2, pick(flat, zero, zero + M_PI / 4));
    const T t = above / greater(below, zero + 1e-300);
    const T z = t * t, z2 = z * z, z4 = z2 * z2;
    const T first = (-0.33333333333328435 + 0.19999999998854168 * z)
        + z2 * (-0.14285714180900647 + 0.11111106177375227 * z);
    const T second = (-0.09090773003240828 + 0.07689952488233016 * z)
        + z2 * (-0.066402251735395 + 0.0568830340363325 * z);
    const T third = -0.04347919839046537 + 0.021133752033748364 * z;
    const T angle = base + (t + t * z * (first + z4 * (second + z4 * third)));
    return pick(y < 0.0, -angle, angle);
}

template <class T> State<T> derivative(const State<T> & s, const Disc & disc)
{
    const T xx = 1 - 2 * (s.e2 * s.e2 + s.e3 * s.e3), xy = 2 * (s.e1 * s.e2 - s.e0 * s.e3),
            xz = 2 * (s.e1 * s.e3 + s.e0 * s.e2), yx = 2 * (s.e1 * s.e2 + s.e0 * s.e3),
            yy = 1 - 2 * (s.e1 * s.e1 + s.e3 * s.e3), yz = 2 * (s.e2 * s.e3 - s.e0 * s.e1),
            zx = 2 * (s.e1 * s.e3 - s.e0 * s.e2), zy = 2 * (s.e2 * s.e3 + s.e0 * s.e1),
            zz = 1 - 2 * (s.e1 * s.e1 + s.e2 * s.e2);
    const T u = xx * s.VX + yx * s.VY + zx * s.VZ;
    const T v = xy * s.VX + yy * s.VY + zy * s.VZ;
    const T w = xz * s.VX + yz * s.VY + zz * s.VZ;
    const T u3 = root(u * u + v * v);
    const T V = root(u3 * u3 + w * w);
    const T per_u3 = 1.0 / greater(u3, greater(1e-4 * V, V * 0.0 + 1e-300));
    const T d_x = u * per_u3, d_y = v * per_u3;
    const Coefficients<T> C = coefficients(arctangent(w, u3), disc);

    const T qS_V = 0.5 * disc.rho * V * disc.S;
    const T lift_in_plane = C.Lift * w;
    const T X = qS_V * (-C.Drag * u + lift_in_plane * d_x);
    const T Y = qS_V * (-C.Drag * v + lift_in_plane * d_y);
    const T Z = qS_V * (-C.Drag * w - C.Lift * u3);

    const T M_steady = qS_V * V * disc.c * C.M;
    const T qScc_2V = 0.5 * qS_V * disc.c * disc.c;
    const T L_p = qScc_2V * disc.C_Lp, M_q = qScc_2V * disc.C_Mq;
    const T isotropic = 0.5 * (L_p + M_q) * (1.0 - d_x * d_x - d_y * d_y);
    const T D_xx = L_p * d_x * d_x + M_q * d_y * d_y + isotropic;
    const T D_xy = (L_p - M_q) * d_x * d_y;
    const T D_yy = L_p * d_y * d_y + M_q * d_x * d_x + isotropic;

    const T H = s.r * disc.I_z;
    const double per_I_x = 1.0 / disc.I_x, per_m = 1.0 / disc.m;
    return {s.VX, s.VY, s.VZ, (xx * X + xy * Y + xz * Z) * per_m,
        (yx * X + yy * Y + yz * Z) * per_m, (zx * X + zy * Y + zz * Z) * per_m + disc.g,
        -0.5 * (s.e1 * s.p + s.e2 * s.q), 0.5 * (s.e0 * s.p - s.e3 * s.q),
        0.5 * (s.e0 * s.q + s.e3 * s.p), 0.5 * (s.e1 * s.q - s.e2 * s.p),
        (-M_steady * d_y + D_xx * s.p + D_xy * s.q - s.q * H) * per_I_x,
        (M_steady * d_x + D_xy * s.p + D_yy * s.q + s.p * H) * per_I_x,
        qScc_2V * disc.C_Nr * s.r / disc.I_z, s.r};
}

template <class T> State<T> step_of(const State<T> & s, double h, const Disc & disc)
{
    const State<T> k1 = derivative(s, disc);
    const State<T> k2 = derivative(axpy(s, 0.5 * h, k1), disc);
    const State<T> k3 = derivative(axpy(s, 0.5 * h, k2), disc);
    const State<T> k4 = derivative(axpy(s, h, k3), disc);
    State<T> x = axpy(axpy(axpy(axpy(s, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4);
    const T n = 1.0 / root(x.e0 * x.e0 + x.e1 * x.e1 + x.e2 * x.e2 + x.e3 * x.e3);
    x.e0 *= n, x.e1 *= n, x.e2 *= n, x.e3 *= n;
    return x;
}

// Where the centre crosses the ground in a step: Newton's method in a bracket.
double landing_of(const State<double> & s, const State<double> & end, double h, const Disc & disc,
    State<double> & result)
{
    double a = 0.0, b = h, x = h * s.Z / (s.Z - end.Z);
    for (int round = 0; round < 100; ++round) {
        if (!(a < x && x < b)) x = 0.5 * (a + b);
        result = step_of(s, x, disc);
        const double next_x = x - result.Z / result.VZ;
        if (result.Z == 0.0 || std::abs(next_x - x) < 1e-12 || b - a < 1e-12) break;
        (result.Z > 0.0 ? b : a) = x;
        x = next_x;
    }
    return x;
}

double * at(State<double> & s) { return &s.X; }
Vector * at(State<Vector> & s) { return &s.X; }

}  // namespace

// Fly `count` throws, a state of 14 numbers each, to the ground; write x, y [m] and time [s].
extern "C" void fly_all(std::int64_t count, const double * states, const Disc * disc, double step,
    double longest, double * landings)
{
    State<Vector> s{};
    std::int64_t flight[lanes], started = 0;
    double steps[lanes] = {};
    const auto start = [&](int lane) {
        flight[lane] = started < count ? started : -1;
        const std::int64_t from = std::min(started, count - 1);  // a lane without a flight goes on
        started += started < count;
        for (int j = 0; j < numbers; ++j) at(s)[j][lane] = states[numbers * from + j];
        steps[lane] = 0.0;
    };
    for (int lane = 0; lane < lanes; ++lane) start(lane);
    for (std::int64_t ended = 0; ended < count;) {
        const State<Vector> next = step_of(s, step, *disc);
        State<Vector> before = s;
        s = next;
        for (int lane = 0; lane < lanes; ++lane) {
            steps[lane] += 1.0;
            if (s.Z[lane] <= 0.0 && steps[lane] * step < longest) continue;
            if (flight[lane] >= 0) {
                State<double> from, to, end;
                for (int j = 0; j < numbers; ++j) {
                    at(from)[j] = at(before)[j][lane];
                    at(to)[j] = at(s)[j][lane];
                }
                const double x = landing_of(from, to, step, *disc, end);
                double * row = landings + 3 * flight[lane];
                row[0] = end.X, row[1] = end.Y, row[2] = (steps[lane] - 1.0) * step + x;
                ++ended;
            }
            start(lane);
        }
    }
}

"""Write scipy_least_squares.json: least-squares problems, solved by SciPy.

    python3 make_scipy_least_squares.py

The solver under test is `host_sim::fit::solve`; this file shares no code with it.
SciPy solves every problem with `least_squares(method="trf")`, exact Jacobians and
tight tolerances. Trust-region-reflective iterates stay inside the box, so a
parameter that it marks as active is put on its bound and the rest solved again.
Standard deviations come from the singular values of the Jacobian of the free
parameters: variance = 2 cost / (rows - free parameters), or 1 where the problem
says that its residuals are whitened.

Where NIST certifies the answer (Statistical Reference Datasets, nonlinear
regression, public domain: https://www.itl.nist.gov/div898/strd/), the certified
values are stored beside SciPy's: a second truth, from outside both programs.
"""

import json
import pathlib
import platform

import numpy as np
import scipy
from scipy.optimize import least_squares

INFINITY = float("inf")

# --- Models: value and Jacobian of y(x; b). -----------------------------------


def rosenbrock(b, x):
    value = np.array([10.0 * (b[1] - b[0] ** 2), 1.0 - b[0]])
    return value, np.array([[-20.0 * b[0], 10.0], [-1.0, 0.0]])


def exponential_decay(b, x):
    e = np.exp(-b[1] * x)
    return b[0] * e + b[2], np.stack([e, -b[0] * x * e, np.ones_like(x)], axis=1)


def split_amplitude_decay(b, x):
    e = np.exp(-b[2] * x)
    amplitude = b[0] + b[1]
    return amplitude * e, np.stack([e, e, -amplitude * x * e], axis=1)


def michaelis_menten(b, x):
    d = b[1] + x
    return b[0] * x / d, np.stack([x / d, -b[0] * x / d**2], axis=1)


def misra1a(b, x):
    e = np.exp(-b[1] * x)
    return b[0] * (1 - e), np.stack([1 - e, b[0] * x * e], axis=1)


def thurber(b, x):
    n = b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3
    d = 1 + b[4] * x + b[5] * x**2 + b[6] * x**3
    columns = [x**k / d for k in range(4)] + [-n * x**k / d**2 for k in (1, 2, 3)]
    return n / d, np.stack(columns, axis=1)


def mgh09(b, x):
    n = x**2 + x * b[1]
    d = x**2 + x * b[2] + b[3]
    columns = [n / d, b[0] * x / d, -b[0] * n * x / d**2, -b[0] * n / d**2]
    return b[0] * n / d, np.stack(columns, axis=1)


def mgh17(b, x):
    e, f = np.exp(-x * b[3]), np.exp(-x * b[4])
    columns = [np.ones_like(x), e, f, -b[1] * x * e, -b[2] * x * f]
    return b[0] + b[1] * e + b[2] * f, np.stack(columns, axis=1)


def eckerle4(b, x):
    z = (x - b[2]) / b[1]
    e = np.exp(-0.5 * z**2) / b[1]
    columns = [e, b[0] * e * (z**2 - 1) / b[1], b[0] * e * z / b[1]]
    return b[0] * e, np.stack(columns, axis=1)


def rat42(b, x):
    e = np.exp(b[1] - b[2] * x)
    d = 1 + e
    return b[0] / d, np.stack([1 / d, -b[0] * e / d**2, b[0] * e * x / d**2], axis=1)


MODELS = {f.__name__: f for f in (
    rosenbrock, exponential_decay, split_amplitude_decay, michaelis_menten, misra1a,
    thurber, mgh09, mgh17, eckerle4, rat42)}

# --- Data. ---------------------------------------------------------------------

MISRA1A = dict(
    x=[77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1,
       689.1, 760.0],
    y=[10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40,
       75.47, 81.78])
MISRA1A_CERTIFIED = dict(
    values=[2.3894212918e+02, 5.5015643181e-04],
    standard_deviations=[2.7070075241e+00, 7.2668688436e-06],
    residual_sum_of_squares=1.2455138894e-01)
THURBER = dict(
    x=[-3.067, -2.981, -2.921, -2.912, -2.840, -2.797, -2.702, -2.699, -2.633, -2.481, -2.363,
       -2.322, -1.501, -1.460, -1.274, -1.212, -1.100, -1.046, -0.915, -0.714, -0.566, -0.545,
       -0.400, -0.309, -0.109, -0.103, 0.010, 0.119, 0.377, 0.790, 0.963, 1.006, 1.115, 1.572,
       1.841, 2.047, 2.200],
    y=[80.574, 84.248, 87.264, 87.195, 89.076, 89.608, 89.868, 90.101, 92.405, 95.854, 100.696,
       101.060, 401.672, 390.724, 567.534, 635.316, 733.054, 759.087, 894.206, 990.785,
       1090.109, 1080.914, 1122.643, 1178.351, 1260.531, 1273.514, 1288.339, 1327.543,
       1353.863, 1414.509, 1425.208, 1421.384, 1442.962, 1464.350, 1468.705, 1447.894,
       1457.628])
THURBER_CERTIFIED = dict(
    values=[1.2881396800e+03, 1.4910792535e+03, 5.8323836877e+02, 7.5416644291e+01,
            9.6629502864e-01, 3.9797285797e-01, 4.9727297349e-02],
    standard_deviations=[4.6647963344e+00, 3.9571156086e+01, 2.8698696102e+01, 5.5675370270e+00,
                         3.1333340687e-02, 1.4984928198e-02, 6.5842344623e-03],
    residual_sum_of_squares=5.6427082397e+03)
MGH09 = dict(
    x=[4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625],
    y=[0.1957, 0.1947, 0.1735, 0.16, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246])
MGH09_CERTIFIED = dict(
    values=[1.9280693458e-01, 1.9128232873e-01, 1.2305650693e-01, 1.3606233068e-01],
    standard_deviations=[1.1435312227e-02, 1.9633220911e-01, 8.0842031232e-02, 9.0025542308e-02],
    residual_sum_of_squares=3.0750560385e-04)
MGH17 = dict(
    x=[10.0 * i for i in range(33)],
    y=[0.844, 0.908, 0.932, 0.936, 0.925, 0.908, 0.881, 0.850, 0.818, 0.784, 0.751, 0.718,
       0.685, 0.658, 0.628, 0.603, 0.580, 0.558, 0.538, 0.522, 0.506, 0.490, 0.478, 0.467,
       0.457, 0.448, 0.438, 0.431, 0.424, 0.420, 0.414, 0.411, 0.406])
MGH17_CERTIFIED = dict(
    values=[3.7541005211e-01, 1.9358469127e+00, -1.4646871366e+00, 1.2867534640e-02,
            2.2122699662e-02],
    standard_deviations=[2.0723153551e-03, 2.2031669222e-01, 2.2175707739e-01, 4.4861358114e-04,
                         8.9471996575e-04],
    residual_sum_of_squares=5.4648946975e-05)
ECKERLE4 = dict(
    x=[400.0, 405.0, 410.0, 415.0, 420.0, 425.0, 430.0, 435.0, 436.5, 438.0, 439.5, 441.0,
       442.5, 444.0, 445.5, 447.0, 448.5, 450.0, 451.5, 453.0, 454.5, 456.0, 457.5, 459.0,
       460.5, 462.0, 463.5, 465.0, 470.0, 475.0, 480.0, 485.0, 490.0, 495.0, 500.0],
    y=[0.0001575, 0.0001699, 0.0002350, 0.0003102, 0.0004917, 0.0008710, 0.0017418, 0.0046400,
       0.0065895, 0.0097302, 0.0149002, 0.0237310, 0.0401683, 0.0712559, 0.1264458, 0.2073413,
       0.2902366, 0.3445623, 0.3698049, 0.3668534, 0.3106727, 0.2078154, 0.1164354, 0.0616764,
       0.0337200, 0.0194023, 0.0117831, 0.0074357, 0.0022732, 0.0008800, 0.0004579, 0.0002345,
       0.0001586, 0.0001143, 0.0000710])
ECKERLE4_CERTIFIED = dict(
    values=[1.5543827178e+00, 4.0888321754e+00, 4.5154121844e+02],
    standard_deviations=[None, 4.6803020753e-02, 4.6800518816e-02],
    residual_sum_of_squares=1.4635887487e-03)
RAT42 = dict(
    x=[9.0, 14.0, 21.0, 28.0, 42.0, 57.0, 63.0, 70.0, 79.0],
    y=[8.930, 10.800, 18.590, 22.330, 39.350, 56.110, 61.730, 64.620, 67.080])
RAT42_CERTIFIED = dict(
    values=[7.2462237576e+01, 2.6180768402e+00, 6.7359200066e-02],
    standard_deviations=[1.7340283401e+00, None, 3.4465663377e-03],
    residual_sum_of_squares=8.0565229338e+00)
# Reaction velocity against substrate concentration, enzyme treated with puromycin
# (Bates and Watts, Nonlinear Regression Analysis, 1988, table A1.3).
PUROMYCIN = dict(
    x=[0.02, 0.02, 0.06, 0.06, 0.11, 0.11, 0.22, 0.22, 0.56, 0.56, 1.10, 1.10],
    y=[76.0, 47.0, 97.0, 107.0, 123.0, 139.0, 159.0, 152.0, 191.0, 201.0, 207.0, 200.0])


def decay_data():
    """A decay with noise of known size and every tenth sample far out."""
    generator = np.random.default_rng(20240501)
    x = np.linspace(0.0, 10.0, 121)
    y = exponential_decay([3.0, 0.6, 0.5], x)[0] + 0.05 * generator.standard_normal(x.size)
    clean = y.copy()
    y[::10] += generator.choice([-1.0, 1.0], y[::10].size) * generator.uniform(0.5, 2.0, y[::10].size)
    return x.tolist(), clean.tolist(), y.tolist()


# --- Solving. --------------------------------------------------------------------


def rows_of(problem):
    """Residuals and Jacobian, the data rows first, then one row per prior."""
    model = MODELS[problem["model"]]
    x, y = np.array(problem["x"]), np.array(problem["y"])
    weight = problem["weight"]
    priors = [(i, p["prior"]) for i, p in enumerate(problem["parameters"]) if p["prior"]]

    def evaluate(b):
        value, jacobian = model(b, x)
        residual = [(value - y) * weight]
        gradient = [jacobian * weight]
        for i, prior in priors:
            residual.append([(b[i] - prior["mean"]) / prior["standard_deviation"]])
            gradient.append(np.eye(len(b))[i : i + 1] / prior["standard_deviation"])
        return np.concatenate(residual), np.concatenate(gradient)

    return evaluate


def run_scipy(problem, evaluate, start, lower, upper, free):
    """SciPy on the free parameters, the others standing where `start` has them."""
    def full(z):
        b = start.copy()
        b[free] = z
        return b

    tolerance = 1e-15
    scale = problem["huber_scale"]
    return least_squares(
        lambda z: evaluate(full(z))[0], start[free], jac=lambda z: evaluate(full(z))[1][:, free],
        bounds=(lower[free], upper[free]), method="trf", x_scale="jac",
        loss="huber" if scale else "linear", f_scale=scale or 1.0,
        ftol=tolerance, xtol=tolerance, gtol=tolerance, max_nfev=20000)


def solve(problem):
    """Fill problem["scipy"]."""
    evaluate = rows_of(problem)
    numbers = lambda key: np.array([p[key] for p in problem["parameters"]], dtype=float)
    start, lower, upper = numbers("start"), numbers("lower"), numbers("upper")
    everything = np.ones(start.size, dtype=bool)
    first = run_scipy(problem, evaluate, start, lower, upper, everything)
    active = first.active_mask
    values = np.where(active < 0, lower, np.where(active > 0, upper, first.x))
    free = active == 0
    result = run_scipy(problem, evaluate, values, lower, upper, free)
    values[free] = result.x
    _, singular, right = np.linalg.svd(result.jac, full_matrices=False)
    kept = singular > singular[0] * 1e-10
    variance = 1.0
    if problem["estimate_noise"]:
        variance = 2 * result.cost / (result.fun.size - kept.sum())
    spread = np.sqrt(variance * np.sum((right[kept] / singular[kept, None]) ** 2, axis=0))
    deviations = np.full(start.size, np.nan)
    deviations[free] = spread
    data_rows = len(problem["y"])
    problem["scipy"] = dict(
        values=values.tolist(),
        cost=float(result.cost),
        residual_sum_of_squares=float(np.sum(evaluate(values)[0][:data_rows] ** 2)),
        standard_deviations=[None if np.isnan(s) else float(s) for s in deviations],
        at_bound=(~free).tolist(),
        rank=int(kept.sum()),
        evaluations=int(first.nfev),
    )
    return problem


def parameter(start, lower=-INFINITY, upper=INFINITY, prior=None):
    return dict(start=start, lower=lower, upper=upper,
                prior=prior and dict(mean=prior[0], standard_deviation=prior[1]))


def problem(name, model, data, parameters, *, certified=None, huber_scale=None, weight=1.0,
            estimate_noise=True):
    return dict(name=name, model=model, x=data["x"], y=data["y"], parameters=parameters,
                weight=weight, huber_scale=huber_scale, estimate_noise=estimate_noise,
                certified=certified)


def free(*starts):
    return [parameter(s) for s in starts]


def problems():
    x, clean, outliers = decay_data()
    clean_data, outlier_data = dict(x=x, y=clean), dict(x=x, y=outliers)
    nothing = dict(x=[0.0, 0.0], y=[0.0, 0.0])
    # Whitened: residuals divided by the noise that decay_data added.
    whitened = dict(weight=1 / 0.05, estimate_noise=False)
    return [
        problem("rosenbrock_free", "rosenbrock", nothing, free(-1.2, 1.0), estimate_noise=False),
        problem("rosenbrock_bounds_not_active", "rosenbrock", nothing,
                [parameter(-1.2, -2, 2), parameter(1.0, -3, 3)], estimate_noise=False),
        problem("rosenbrock_lower_bound_active", "rosenbrock", nothing,
                [parameter(2.0, -10, 10), parameter(2.0, 1.5, 10)], estimate_noise=False),
        problem("rosenbrock_upper_bound_active", "rosenbrock", nothing,
                [parameter(-1.2, -10, 0.8), parameter(1.0, -10, 10)], estimate_noise=False),
        problem("rosenbrock_corner", "rosenbrock", nothing,
                [parameter(0.0, -1, 0.5), parameter(0.0, -1, 0.1)], estimate_noise=False),
        problem("decay_clean", "exponential_decay", clean_data, free(1.0, 1.0, 0.0)),
        problem("decay_outliers_linear", "exponential_decay", outlier_data, free(1.0, 1.0, 0.0)),
        problem("decay_outliers_huber", "exponential_decay", outlier_data, free(1.0, 1.0, 0.0),
                huber_scale=0.1),
        problem("decay_outliers_huber_whitened", "exponential_decay", outlier_data,
                free(1.0, 1.0, 0.0), huber_scale=1.345, **whitened),
        problem("decay_outliers_huber_bound", "exponential_decay", outlier_data,
                [parameter(1.0, 0, 10), parameter(1.0, 0, 10), parameter(0.0, -1, 0.4)],
                huber_scale=0.1),
        problem("decay_priors", "exponential_decay", clean_data,
                [parameter(1.0, prior=(3.1, 0.02)), parameter(1.0),
                 parameter(0.0, prior=(0.45, 0.01))], **whitened),
        problem("decay_priors_and_bounds", "exponential_decay", clean_data,
                [parameter(1.0, 0, 2.9, prior=(3.1, 0.02)), parameter(1.0, 0, 5),
                 parameter(0.0, -1, 1, prior=(0.45, 0.01))], **whitened),
        problem("split_amplitude_rank_deficient", "split_amplitude_decay",
                dict(x=x, y=(np.array(clean) - 0.5).tolist()), free(1.0, 0.5, 1.0)),
        problem("split_amplitude_cured_by_prior", "split_amplitude_decay",
                dict(x=x, y=(np.array(clean) - 0.5).tolist()),
                [parameter(1.0, prior=(1.0, 0.1)), parameter(0.5), parameter(1.0)], **whitened),
        problem("puromycin", "michaelis_menten", PUROMYCIN, free(150.0, 0.2)),
        problem("puromycin_bounded", "michaelis_menten", PUROMYCIN,
                [parameter(150.0, 0, 205), parameter(0.2, 0, 1)]),
        problem("misra1a_start_1", "misra1a", MISRA1A, free(500.0, 1e-4),
                certified=MISRA1A_CERTIFIED),
        problem("misra1a_start_2", "misra1a", MISRA1A, free(250.0, 5e-4),
                certified=MISRA1A_CERTIFIED),
        problem("thurber_start_1", "thurber", THURBER, free(1000, 1000, 400, 40, 0.7, 0.3, 0.03),
                certified=THURBER_CERTIFIED),
        problem("thurber_start_2", "thurber", THURBER, free(1300, 1500, 500, 75, 1, 0.4, 0.05),
                certified=THURBER_CERTIFIED),
        problem("mgh09_start_1", "mgh09", MGH09,
                [parameter(s, 0, 100) for s in (25.0, 39.0, 41.5, 39.0)],
                certified=MGH09_CERTIFIED),
        problem("mgh09_start_2", "mgh09", MGH09, free(0.25, 0.39, 0.415, 0.39),
                certified=MGH09_CERTIFIED),
        problem("mgh17_start_2", "mgh17", MGH17, free(0.5, 1.5, -1.0, 0.01, 0.02),
                certified=MGH17_CERTIFIED),
        problem("eckerle4_start_2", "eckerle4", ECKERLE4, free(1.5, 5.0, 450.0),
                certified=ECKERLE4_CERTIFIED),
        problem("rat42_start_1", "rat42", RAT42, free(100.0, 1.0, 0.1),
                certified=RAT42_CERTIFIED),
        problem("rat42_start_2", "rat42", RAT42, free(75.0, 2.5, 0.07),
                certified=RAT42_CERTIFIED),
    ]


def without_infinities(value):
    """JSON has no infinity: an absent bound is null."""
    if isinstance(value, dict):
        return {k: without_infinities(v) for k, v in value.items()}
    if isinstance(value, list):
        return [without_infinities(v) for v in value]
    return None if isinstance(value, float) and abs(value) == INFINITY else value


def main():
    solved = [solve(p) for p in problems()]
    for p in solved:
        print(p["name"], p["scipy"]["values"], p["scipy"]["cost"], p["scipy"]["standard_deviations"],
              p["scipy"]["at_bound"], p["scipy"]["evaluations"], sep="  ")
    document = dict(
        made_by="make_scipy_least_squares.py",
        python=platform.python_version(), numpy=np.__version__, scipy=scipy.__version__,
        problems=without_infinities(solved))
    target = pathlib.Path(__file__).with_name("scipy_least_squares.json")
    target.write_text(json.dumps(document, indent=1) + "\n")


if __name__ == "__main__":
    main()

"""``python -m bench.synthetic``: invented cells that join a desk."""

from bench.synthetic.running import main

if __name__ == "__main__":
    main()

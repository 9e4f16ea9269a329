"""``python -m farm.synthetic``: invented cells that join a desk."""

from farm.synthetic.io.running import main

if __name__ == "__main__":
    main()
